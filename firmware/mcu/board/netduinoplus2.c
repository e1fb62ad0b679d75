/* firmware/mcu/board/netduinoplus2.c - Netduino Plus 2: STM32F405 at 168 MHz,
 * 128 KB of RAM.  USART1 on PA9 and PA10 is the port to command it, USART2 on
 * PA2 and PA3 the one to servo drives.
 * Source: ST, RM0090, 6 (RCC), 8 (GPIO), 21 (IWDG), 30 (USART). */
#include "firmware/mcu/board/board.h"
#include "firmware/mcu/board/cortex_m.h"

#define CLOCK_HZ  168000000u
#define WINDOW    32
#define LOG_WORDS 4096

#define RCC_CR          REGISTER(0x40023800)
#define RCC_PLLCFGR     REGISTER(0x40023804)
#define RCC_CFGR        REGISTER(0x40023808)
#define RCC_AHB1ENR     REGISTER(0x40023830)
#define RCC_APB1ENR     REGISTER(0x40023840)
#define RCC_APB2ENR     REGISTER(0x40023844)
#define FLASH_ACR       REGISTER(0x40023C00)
#define GPIOA_MODER     REGISTER(0x40020000)
#define GPIOA_AFRL      REGISTER(0x40020020)
#define GPIOA_AFRH      REGISTER(0x40020024)
#define USART1          0x40011000u
#define USART2          0x40004400u
#define USART_SR(base)  REGISTER((base) + 0x00)
#define USART_DR(base)  REGISTER((base) + 0x04)
#define USART_BRR(base) REGISTER((base) + 0x08)
#define USART_CR1(base) REGISTER((base) + 0x0C)
#define USART_CR2(base) REGISTER((base) + 0x10)
#define IWDG_KR         REGISTER(0x40003000)
#define IWDG_PR         REGISTER(0x40003004)
#define IWDG_RLR        REGISTER(0x40003008)
#define CR_HSEON        (1u << 16)
#define CR_HSERDY       (1u << 17)
#define CR_PLLON        (1u << 24)
#define CR_PLLRDY       (1u << 25)
#define CFGR_SW_PLL     2u
#define CFGR_SWS        0xCu
#define CFGR_SWS_PLL    0x8u
#define SR_RXNE         (1u << 5)
#define SR_TXE          (1u << 7)
#define CR1_TXEIE       (1u << 7)
#define CR1_ON          (1u << 13 | 1u << 5 | 1u << 3 | 1u << 2)
#define CR1_PS_ODD      (1u << 9)
#define CR1_PCE         (1u << 10)
#define CR1_M_9         (1u << 12)
#define CR2_STOP_2      (2u << 12)
#define IRQ_USART1      37
#define IRQ_USART2      38
#define PLL_HSE         (1u << 22)
#define PLL_25_MHZ      25u
#define PLL_336         (336u << 6)
#define PLL_USB         (7u << 24)
#define CFGR_APB1_4     (5u << 10)
#define CFGR_APB2_2     (4u << 13)
#define FLASH_5_CACHED  0x705u
#define APB1_HZ         42000000u
#define APB2_HZ         84000000u
#define WATCHDOG_250_MS 250u /* of 32 kHz / 32 */

static struct motion_segment netduino_ring[MCU_AXES_MAX * 2 * WINDOW];
static int64_t netduino_log[LOG_WORDS];
static struct mcu_servos netduino_servos;
struct board_port board_slave_port, board_master_port;

const struct board_memory board_memory = { .board = 2,
                                           .ring = netduino_ring,
                                           .window = WINDOW,
                                           .log = netduino_log,
                                           .log_words = LOG_WORDS,
                                           .servos = &netduino_servos };

static void netduino_wait(volatile uint32_t *at, uint32_t mask, uint32_t value)
{
    while ((*at & mask) != value) {
        /* without its clock the board has no time: it stays off */
    }
}

/* 25 MHz / 25 * 336 / 2.  RCC_CR is never 0 on the chip (HSION is set by
 * reset); QEMU 7.2 has no RCC, and runs at 168 MHz from the start. */
static void netduino_clock(void)
{
    if (RCC_CR == 0)
        return;
    RCC_CR |= CR_HSEON;
    netduino_wait(&RCC_CR, CR_HSERDY, CR_HSERDY);
    RCC_PLLCFGR = PLL_USB | PLL_HSE | PLL_336 | PLL_25_MHZ;
    RCC_CR |= CR_PLLON;
    netduino_wait(&RCC_CR, CR_PLLRDY, CR_PLLRDY);
    FLASH_ACR = FLASH_5_CACHED;
    RCC_CFGR = CFGR_APB1_4 | CFGR_APB2_2;
    RCC_CFGR |= CFGR_SW_PLL;
    netduino_wait(&RCC_CFGR, CFGR_SWS, CFGR_SWS_PLL);
}

uint32_t board_init(void)
{
    netduino_clock();
    RCC_AHB1ENR |= 1u;
    RCC_APB2ENR |= 1u << 4;
    GPIOA_MODER = (GPIOA_MODER & ~(0xFu << 18)) | 0xAu << 18;
    GPIOA_AFRH = (GPIOA_AFRH & ~0xFF0u) | 0x770u;
    USART_BRR(USART1) = (APB2_HZ + BOARD_BAUD / 2) / BOARD_BAUD;
    USART_CR1(USART1) = CR1_ON;
    board_enable_irq(IRQ_USART1);
    IWDG_KR = 0x5555;
    IWDG_PR = 3;
    IWDG_RLR = WATCHDOG_250_MS;
    IWDG_KR = 0xCCCC;
    return CLOCK_HZ;
}

/* The parity bit is one of nine.  (RM0090, 30.3.4: at most a 16th of the
 * clock.) */
int board_master_open(const struct modbus_rtu_line *line)
{
    uint32_t cr1 = CR1_ON;

    if (line->baud > APB1_HZ / 16)
        return MOTION_E_ARG;
    if (line->parity != MODBUS_PARITY_NONE)
        cr1 |= CR1_M_9 | CR1_PCE;
    if (line->parity == MODBUS_PARITY_ODD)
        cr1 |= CR1_PS_ODD;
    RCC_APB1ENR |= 1u << 17;
    GPIOA_MODER = (GPIOA_MODER & ~(0xFu << 4)) | 0xAu << 4;
    GPIOA_AFRL = (GPIOA_AFRL & ~0xFF00u) | 0x7700u;
    USART_CR1(USART2) = 0;
    USART_BRR(USART2) = (APB1_HZ + line->baud / 2) / line->baud;
    USART_CR2(USART2) = line->stop_bits == 2 ? CR2_STOP_2 : 0;
    USART_CR1(USART2) = cr1;
    board_enable_irq(IRQ_USART2);
    return MOTION_OK;
}

/* The crystal has stopped (RM0090, 6.2.7). */
void board_nmi_isr(void)
{
    board_fault_isr();
}

void board_watchdog_feed(void)
{
    IWDG_KR = 0xAAAA;
}

/* As much as it takes now; the interrupt goes on.  (That of QEMU 7.2, which
 * has no interrupt for sending, takes all.) */
static void netduino_send(uint32_t usart, struct board_port *port)
{
    USART_CR1(usart) &= ~CR1_TXEIE;
    while ((USART_SR(usart) & SR_TXE) != 0) {
        const int next = board_port_next_isr(port);
        if (next < 0)
            return;
        USART_DR(usart) = (uint32_t)next;
    }
    USART_CR1(usart) |= CR1_TXEIE;
}

static void netduino_serve(uint32_t usart, struct board_port *port)
{
    while ((USART_SR(usart) & SR_RXNE) != 0)
        board_port_received_isr(port, (uint8_t)USART_DR(usart));
    if ((USART_CR1(usart) & CR1_TXEIE) != 0)
        netduino_send(usart, port);
}

static void netduino_usart1_isr(void)
{
    netduino_serve(USART1, &board_slave_port);
}

static void netduino_usart2_isr(void)
{
    netduino_serve(USART2, &board_master_port);
}

void board_port_start(struct board_port *port)
{
    netduino_send(port == &board_slave_port ? USART1 : USART2, port);
}

static void netduino_none_isr(void)
{
    board_fault_isr();
}

__attribute__((section(".irqs"), used)) void (*const board_irq_vectors[])(
    void) = { [0 ... IRQ_USART1 - 1] = netduino_none_isr,
              netduino_usart1_isr,
              netduino_usart2_isr };
