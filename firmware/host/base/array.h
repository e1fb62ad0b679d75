/* firmware/host/base/array.h - how many elements an array has. */
#ifndef FIRMWARE_HOST_BASE_ARRAY_H
#define FIRMWARE_HOST_BASE_ARRAY_H

#define ARRAY_LEN(a) (sizeof(a) / sizeof(a)[0])

#endif
