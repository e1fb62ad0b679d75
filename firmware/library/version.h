/* firmware/library/version.h - which slew this is (semver.org).  The Makefile
 * reads it too: libslew.so is named by the first number, or by the first two
 * while that is 0. */
#ifndef FIRMWARE_LIBRARY_VERSION_H
#define FIRMWARE_LIBRARY_VERSION_H

#define SLEW_VERSION "0.1.0"

#endif
