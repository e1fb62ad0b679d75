/* hal/linux/socketcan_link.c - see socketcan_link.h. */
#define _GNU_SOURCE /* struct ifinfomsg's flags */
#include "hal/linux/socketcan_link.h"

#include <errno.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <linux/can.h>
#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>

#define CAN_LINK_ANSWER_MAX 16384

/* ---- attributes ---- */

struct can_link_request {
    struct nlmsghdr head;
    struct ifinfomsg info;
    struct rtattr name_head;
    char name[CAN_LINK_NAME_MAX];
};

/* Calls `take` for every attribute in `bytes` of them. */
static void can_link_each(const void *first, size_t bytes,
                          void (*take)(const struct rtattr *attribute,
                                       struct can_link *link),
                          struct can_link *link)
{
    const struct rtattr *attribute = first;

    while (bytes >= sizeof *attribute && attribute->rta_len >= RTA_LENGTH(0) &&
           attribute->rta_len <= bytes) {
        const size_t step = RTA_ALIGN(attribute->rta_len);

        take(attribute, link);
        if (step >= bytes)
            return;
        bytes -= step;
        attribute = (const void *)((const char *)attribute + step);
    }
}

/* Up to `size` bytes of an attribute; false: it is shorter. */
static bool can_link_get(const struct rtattr *attribute, void *out, size_t size)
{
    if (RTA_PAYLOAD(attribute) < size)
        return false;
    memcpy(out, RTA_DATA(attribute), size);
    return true;
}

static void can_link_take_state(const struct rtattr *attribute,
                                struct can_link *link)
{
    static const enum hal_can_state state[] = {
        [CAN_STATE_ERROR_ACTIVE] = HAL_CAN_ACTIVE,
        [CAN_STATE_ERROR_WARNING] = HAL_CAN_WARNING,
        [CAN_STATE_ERROR_PASSIVE] = HAL_CAN_PASSIVE,
        [CAN_STATE_BUS_OFF] = HAL_CAN_BUS_OFF,
    };
    uint32_t value;

    if (can_link_get(attribute, &value, sizeof value))
        link->state = value < sizeof state / sizeof state[0] ? state[value]
                                                             : HAL_CAN_DOWN;
}

static void can_link_take_can(const struct rtattr *attribute,
                              struct can_link *link)
{
    struct can_bittiming timing;
    struct can_berr_counter errors;

    switch (attribute->rta_type) {
    case IFLA_CAN_STATE:
        can_link_take_state(attribute, link);
        break;
    case IFLA_CAN_RESTART_MS:
        (void)can_link_get(attribute, &link->restart_ms,
                           sizeof link->restart_ms);
        break;
    case IFLA_CAN_BITTIMING:
        if (can_link_get(attribute, &timing, sizeof timing)) {
            link->bit_rate = timing.bitrate;
            link->sample_permille = (uint16_t)timing.sample_point;
        }
        break;
    case IFLA_CAN_BERR_COUNTER:
        if (can_link_get(attribute, &errors, sizeof errors)) {
            link->tx_errors = errors.txerr;
            link->rx_errors = errors.rxerr;
        }
        break;
    case IFLA_CAN_DATA_BITTIMING:
        if (can_link_get(attribute, &timing, sizeof timing))
            link->data_bit_rate = timing.bitrate;
        break;
    default:
        break;
    }
}

static void can_link_take_info(const struct rtattr *attribute,
                               struct can_link *link)
{
    size_t len = RTA_PAYLOAD(attribute);

    if (attribute->rta_type == IFLA_INFO_KIND) {
        len = len < sizeof link->kind - 1 ? len : sizeof link->kind - 1;
        memcpy(link->kind, RTA_DATA(attribute), len);
    } else if (attribute->rta_type == IFLA_INFO_DATA &&
               strcmp(link->kind, "can") == 0) {
        can_link_each(RTA_DATA(attribute), len, can_link_take_can, link);
    }
}

static void can_link_take(const struct rtattr *attribute, struct can_link *link)
{
    uint32_t value;

    switch (attribute->rta_type) {
    case IFLA_MTU:
        if (can_link_get(attribute, &value, sizeof value))
            link->fd = value == CANFD_MTU;
        break;
    case IFLA_TXQLEN:
        if (can_link_get(attribute, &value, sizeof value))
            link->tx_queue = value;
        break;
    case IFLA_LINKINFO:
        can_link_each(RTA_DATA(attribute), RTA_PAYLOAD(attribute),
                      can_link_take_info, link);
        break;
    default:
        break;
    }
}

/* ---- question and answer ---- */

static int can_link_query(int socket_fd, const char *name)
{
    struct can_link_request request = {
        .head = { .nlmsg_len = sizeof request,
                  .nlmsg_type = RTM_GETLINK,
                  .nlmsg_flags = NLM_F_REQUEST },
        .info.ifi_family = AF_UNSPEC,
        .name_head = { .rta_len = RTA_LENGTH(CAN_LINK_NAME_MAX),
                       .rta_type = IFLA_IFNAME },
    };

    strncpy(request.name, name, sizeof request.name - 1);
    return send(socket_fd, &request, sizeof request, 0) == sizeof request
               ? MOTION_OK
               : MOTION_E_IO;
}

static int can_link_error(const struct nlmsghdr *head)
{
    const struct nlmsgerr *error = NLMSG_DATA(head);

    if (head->nlmsg_len < NLMSG_LENGTH(sizeof *error))
        return MOTION_E_IO;
    return error->error == -ENODEV ? MOTION_E_EMPTY : MOTION_E_IO;
}

static int can_link_answer(const struct nlmsghdr *head, size_t bytes,
                           struct can_link *link)
{
    const struct ifinfomsg *info = NLMSG_DATA(head);

    if (bytes < NLMSG_HDRLEN || head->nlmsg_len > bytes)
        return MOTION_E_IO;
    if (head->nlmsg_type == NLMSG_ERROR)
        return can_link_error(head);
    if (head->nlmsg_type != RTM_NEWLINK ||
        head->nlmsg_len < NLMSG_LENGTH(sizeof *info))
        return MOTION_E_IO;
    *link = (struct can_link){
        .index = (unsigned)info->ifi_index,
        .is_can = info->ifi_type == ARPHRD_CAN,
        .up = (info->ifi_flags & IFF_UP) != 0,
        .running = (info->ifi_flags & IFF_RUNNING) != 0,
    };
    can_link_each(IFLA_RTA(info), head->nlmsg_len - NLMSG_LENGTH(sizeof *info),
                  can_link_take, link);
    if (!link->up)
        link->state = HAL_CAN_DOWN;
    return MOTION_OK;
}

int can_link_read(const char *name, struct can_link *link)
{
    static const struct timeval patience = { .tv_sec = 1 };
    union { /* aligned as a header has to be */
        struct nlmsghdr head;
        char bytes[CAN_LINK_ANSWER_MAX];
    } answer;
    ssize_t got;
    int err, socket_fd;

    if (name[0] == '\0' || strlen(name) >= CAN_LINK_NAME_MAX)
        return MOTION_E_ARG;
    socket_fd = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
    if (socket_fd < 0)
        return MOTION_E_IO;
    (void)setsockopt(socket_fd, SOL_SOCKET, SO_RCVTIMEO, &patience,
                     sizeof patience);
    err = can_link_query(socket_fd, name);
    if (err == MOTION_OK) {
        got = recv(socket_fd, &answer, sizeof answer, 0);
        err = got < 0 ? MOTION_E_IO
                      : can_link_answer(&answer.head, (size_t)got, link);
    }
    close(socket_fd);
    return err;
}
