/* firmware/host/kind/moteus/quantity.h - the registers of a moteus.
 *
 * Source: mjbots moteus, docs/protocol/registers.md. */
#ifndef FIRMWARE_HOST_KIND_MOTEUS_QUANTITY_H
#define FIRMWARE_HOST_KIND_MOTEUS_QUANTITY_H

#include "firmware/host/device/quantity.h"

const struct quantity *quantity_of_moteus(unsigned *count);

#endif
