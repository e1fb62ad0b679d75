/* firmware/mcu/board/cortex_m.h - registers, and what the vectors call. */
#ifndef FIRMWARE_MCU_BOARD_CORTEX_M_H
#define FIRMWARE_MCU_BOARD_CORTEX_M_H

#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))

/* Entry of the image, and the handlers in its vectors. */
void board_reset(void);
void board_fault_isr(void);
void board_systick_isr(void);
void board_nmi_isr(void); /* the board's own */

/* Vectors of the board's own interrupts, behind the 16 of the processor. */
extern void (*const board_irq_vectors[])(void);

#endif
