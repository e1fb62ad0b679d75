/* sim/device/cia402/rows.h - every object of the simulated drive, in one list.
 *
 * X(name, index, sub, type, access, default, min, max); min = max = 0: the
 * whole range of the type.  Access: R, W by SDO; T, P may be mapped into a TPDO
 * or RPDO ("P" as in put); N: the node id is added to the default; D: a dummy
 * that only pads a mapping.  Source: CiA 301 7.5, CiA 402-2. */
#ifndef SIM_DEVICE_CIA402_ROWS_H
#define SIM_DEVICE_CIA402_ROWS_H

#define CIA402_DUMMY_ROWS(X)                                                   \
    X(DUMMY_I8, 0x0002, 0, I8, D, 0, 0, 0)                                     \
    X(DUMMY_I16, 0x0003, 0, I16, D, 0, 0, 0)                                   \
    X(DUMMY_I32, 0x0004, 0, I32, D, 0, 0, 0)                                   \
    X(DUMMY_U8, 0x0005, 0, U8, D, 0, 0, 0)                                     \
    X(DUMMY_U16, 0x0006, 0, U16, D, 0, 0, 0)                                   \
    X(DUMMY_U32, 0x0007, 0, U32, D, 0, 0, 0)

#define CIA402_COM_ROWS(X)                                                     \
    X(DEVICE_TYPE, 0x1000, 0, U32, R, 0x00020192, 0, 0)                        \
    X(ERROR_REGISTER, 0x1001, 0, U8, R | T, 0, 0, 0)                           \
    X(HISTORY_COUNT, 0x1003, 0, U8, R | W, 0, 0, 0)                            \
    X(HISTORY_1, 0x1003, 1, U32, R, 0, 0, 0)                                   \
    X(HISTORY_2, 0x1003, 2, U32, R, 0, 0, 0)                                   \
    X(HISTORY_3, 0x1003, 3, U32, R, 0, 0, 0)                                   \
    X(HISTORY_4, 0x1003, 4, U32, R, 0, 0, 0)                                   \
    X(SYNC_COB, 0x1005, 0, U32, R | W, 0x80, 0, 0)                             \
    X(SYNC_PERIOD, 0x1006, 0, U32, R | W, 0, 0, 0)                             \
    X(SYNC_WINDOW, 0x1007, 0, U32, R | W, 0, 0, 0)                             \
    X(GUARD_TIME, 0x100C, 0, U16, R | W, 0, 0, 0)                              \
    X(LIFE_FACTOR, 0x100D, 0, U8, R | W, 0, 0, 0)                              \
    X(TIME_COB, 0x1012, 0, U32, R | W, 0x80000100, 0, 0)                       \
    X(NAME, 0x1008, 0, TEXT, R, 0, 0, 0)                                       \
    X(HARDWARE, 0x1009, 0, TEXT, R, 1, 0, 0)                                   \
    X(SOFTWARE, 0x100A, 0, TEXT, R, 1, 0, 0)                                   \
    X(STORE_COUNT, 0x1010, 0, U8, R, 1, 0, 0)                                  \
    X(STORE, 0x1010, 1, U32, R | W, 1, 0, 0)                                   \
    X(EMCY_COB, 0x1014, 0, U32, R | W | N, 0x80, 0, 0)                         \
    X(CONSUMER_COUNT, 0x1016, 0, U8, R, 1, 0, 0)                               \
    X(CONSUMER, 0x1016, 1, U32, R | W, 0, 0, 0x007FFFFF)                       \
    X(PRODUCER, 0x1017, 0, U16, R | W, 0, 0, 0)                                \
    X(IDENTITY_COUNT, 0x1018, 0, U8, R, 4, 0, 0)                               \
    X(VENDOR, 0x1018, 1, U32, R, 0, 0, 0)                                      \
    X(PRODUCT, 0x1018, 2, U32, R, 402, 0, 0)                                   \
    X(REVISION, 0x1018, 3, U32, R, 0x00010000, 0, 0)                           \
    X(SERIAL, 0x1018, 4, U32, R | N, 0, 0, 0)                                  \
    X(SYNC_OVERFLOW, 0x1019, 0, U8, R | W, 0, 0, 240)                          \
    X(ERROR_BEHAVIOUR_COUNT, 0x1029, 0, U8, R, 1, 0, 0)                        \
    X(ERROR_BEHAVIOUR, 0x1029, 1, U8, R | W, 0, 0, 2)

/* One communication record; the rows of all eight are alike and in this order,
 * see pdo.c. */
#define CIA402_PDO_ROWS(X, P, index, cob, off)                                 \
    X(P##_COUNT, index, 0, U8, R, 5, 0, 0)                                     \
    X(P##_COB, index, 1, U32, R | W | N, (off) | (cob), 0, 0)                  \
    X(P##_TYPE, index, 2, U8, R | W, 1, 0, 0)                                  \
    X(P##_INHIBIT, index, 3, U16, R | W, 0, 0, 0)                              \
    X(P##_EVENT, index, 5, U16, R | W, 0, 0, 0)

#define CIA402_MAP_ROWS(X, M, index, count, first, second)                     \
    X(M##_COUNT, index, 0, U8, R | W, count, 0, 8)                             \
    X(M##_1, index, 1, U32, R | W, first, 0, 0)                                \
    X(M##_2, index, 2, U32, R | W, second, 0, 0)                               \
    X(M##_3, index, 3, U32, R | W, 0, 0, 0)                                    \
    X(M##_4, index, 4, U32, R | W, 0, 0, 0)                                    \
    X(M##_5, index, 5, U32, R | W, 0, 0, 0)                                    \
    X(M##_6, index, 6, U32, R | W, 0, 0, 0)                                    \
    X(M##_7, index, 7, U32, R | W, 0, 0, 0)                                    \
    X(M##_8, index, 8, U32, R | W, 0, 0, 0)

#define CIA402_PDO_OFF 0x80000000u

#define CIA402_RPDO_ROWS(X)                                                    \
    CIA402_PDO_ROWS(X, RPDO1, 0x1400, 0x200, 0)                                \
    CIA402_PDO_ROWS(X, RPDO2, 0x1401, 0x300, CIA402_PDO_OFF)                   \
    CIA402_PDO_ROWS(X, RPDO3, 0x1402, 0x400, CIA402_PDO_OFF)                   \
    CIA402_PDO_ROWS(X, RPDO4, 0x1403, 0x500, CIA402_PDO_OFF)                   \
    CIA402_MAP_ROWS(X, RMAP1, 0x1600, 1, 0x60400010, 0)                        \
    CIA402_MAP_ROWS(X, RMAP2, 0x1601, 2, 0x60400010, 0x607A0020)               \
    CIA402_MAP_ROWS(X, RMAP3, 0x1602, 0, 0, 0)                                 \
    CIA402_MAP_ROWS(X, RMAP4, 0x1603, 0, 0, 0)

#define CIA402_TPDO_ROWS(X)                                                    \
    CIA402_PDO_ROWS(X, TPDO1, 0x1800, 0x180, 0)                                \
    CIA402_PDO_ROWS(X, TPDO2, 0x1801, 0x280, CIA402_PDO_OFF)                   \
    CIA402_PDO_ROWS(X, TPDO3, 0x1802, 0x380, CIA402_PDO_OFF)                   \
    CIA402_PDO_ROWS(X, TPDO4, 0x1803, 0x480, CIA402_PDO_OFF)                   \
    CIA402_MAP_ROWS(X, TMAP1, 0x1A00, 1, 0x60410010, 0)                        \
    CIA402_MAP_ROWS(X, TMAP2, 0x1A01, 2, 0x60410010, 0x60640020)               \
    CIA402_MAP_ROWS(X, TMAP3, 0x1A02, 0, 0, 0)                                 \
    CIA402_MAP_ROWS(X, TMAP4, 0x1A03, 0, 0, 0)

#define CIA402_MAKER_ROWS(X)                                                   \
    X(INJECT, 0x2000, 0, U8, W, 0, 1, SIM_CIA402_FAULTS)                       \
    X(TARGETS_MISSED_MAX, 0x2001, 0, U8, R | W, 20, 0, 0)                      \
    X(NOTES, 0x2002, 0, DOMAIN, R | W, 0, 0, 0)                                \
    X(TEMPERATURE, 0x2003, 0, I16, R | T, 300, 0, 0)

#define CIA402_DRIVE_ROWS(X)                                                   \
    X(ABORT_OPTION, 0x6007, 0, I16, R | W, 1, 0, 3)                            \
    X(ERROR_CODE, 0x603F, 0, U16, R | T, 0, 0, 0)                              \
    X(CONTROLWORD, 0x6040, 0, U16, R | W | P | T, 0, 0, 0)                     \
    X(STATUSWORD, 0x6041, 0, U16, R | T, 0, 0, 0)                              \
    X(QUICK_STOP_OPTION, 0x605A, 0, I16, R | W, 2, 0, 8)                       \
    X(SHUTDOWN_OPTION, 0x605B, 0, I16, R | W, 0, 0, 1)                         \
    X(DISABLE_OPTION, 0x605C, 0, I16, R | W, 1, 0, 1)                          \
    X(HALT_OPTION, 0x605D, 0, I16, R | W, 1, 1, 4)                             \
    X(FAULT_OPTION, 0x605E, 0, I16, R | W, 2, 0, 4)                            \
    X(MODE, 0x6060, 0, I8, R | W | P, 0, 0, 9)                                 \
    X(MODE_DISPLAY, 0x6061, 0, I8, R | T, 0, 0, 0)                             \
    X(POSITION_DEMAND, 0x6062, 0, I32, R | T, 0, 0, 0)                         \
    X(POSITION_INTERNAL, 0x6063, 0, I32, R | T, 0, 0, 0)                       \
    X(POSITION, 0x6064, 0, I32, R | T, 0, 0, 0)                                \
    X(FOLLOWING_WINDOW, 0x6065, 0, U32, R | W | P, 65536, 0, 0)                \
    X(FOLLOWING_TIME, 0x6066, 0, U16, R | W | P, 0, 0, 0)                      \
    X(POSITION_WINDOW, 0x6067, 0, U32, R | W | P, 100, 0, 0)                   \
    X(POSITION_TIME, 0x6068, 0, U16, R | W | P, 0, 0, 0)                       \
    X(VELOCITY_DEMAND, 0x606B, 0, I32, R | T, 0, 0, 0)                         \
    X(VELOCITY, 0x606C, 0, I32, R | T, 0, 0, 0)                                \
    X(VELOCITY_WINDOW, 0x606D, 0, U16, R | W | P, 2000, 0, 0)                  \
    X(VELOCITY_TIME, 0x606E, 0, U16, R | W | P, 0, 0, 0)                       \
    X(STANDING_WINDOW, 0x606F, 0, U16, R | W | P, 1000, 0, 0)                  \
    X(STANDING_TIME, 0x6070, 0, U16, R | W | P, 0, 0, 0)                       \
    X(RATED_CURRENT, 0x6075, 0, U32, R, 5000, 0, 0)                            \
    X(TORQUE, 0x6077, 0, I16, R | T, 0, 0, 0)                                  \
    X(CURRENT, 0x6078, 0, I16, R | T, 0, 0, 0)                                 \
    X(DC_LINK_VOLTAGE, 0x6079, 0, U32, R | T, 24000, 0, 0)                     \
    X(TARGET_POSITION, 0x607A, 0, I32, R | W | P | T, 0, 0, 0)                 \
    X(HOME_OFFSET, 0x607C, 0, I32, R | W, 0, 0, 0)                             \
    X(LIMIT_COUNT, 0x607D, 0, U8, R, 2, 0, 0)                                  \
    X(LIMIT_MIN, 0x607D, 1, I32, R | W, 0, 0, 0)                               \
    X(LIMIT_MAX, 0x607D, 2, I32, R | W, 0, 0, 0)                               \
    X(PROFILE_VELOCITY_MAX, 0x607F, 0, U32, R | W | P, UINT32_MAX, 0, 0)       \
    X(MOTOR_SPEED_MAX, 0x6080, 0, U32, R | W | P, UINT32_MAX, 0, 0)            \
    X(PROFILE_VELOCITY, 0x6081, 0, U32, R | W | P, 0, 0, 0)                    \
    X(PROFILE_ACCELERATION, 0x6083, 0, U32, R | W | P, 1, 1, UINT32_MAX)       \
    X(PROFILE_DECELERATION, 0x6084, 0, U32, R | W | P, 1, 1, UINT32_MAX)       \
    X(QUICK_STOP_DECELERATION, 0x6085, 0, U32, R | W | P, 1, 1, UINT32_MAX)    \
    X(ENCODER_COUNT, 0x608F, 0, U8, R, 2, 0, 0)                                \
    X(ENCODER_INCREMENTS, 0x608F, 1, U32, R | W, 10000, 1, UINT32_MAX)         \
    X(ENCODER_REVOLUTIONS, 0x608F, 2, U32, R | W, 1, 1, UINT32_MAX)            \
    X(GEAR_COUNT, 0x6091, 0, U8, R, 2, 0, 0)                                   \
    X(GEAR_MOTOR, 0x6091, 1, U32, R | W, 1, 1, UINT32_MAX)                     \
    X(GEAR_SHAFT, 0x6091, 2, U32, R | W, 1, 1, UINT32_MAX)                     \
    X(FEED_COUNT, 0x6092, 0, U8, R, 2, 0, 0)                                   \
    X(FEED, 0x6092, 1, U32, R | W, 10000, 1, UINT32_MAX)                       \
    X(FEED_REVOLUTIONS, 0x6092, 2, U32, R | W, 1, 1, UINT32_MAX)               \
    X(VELOCITY_FACTOR_COUNT, 0x6096, 0, U8, R, 2, 0, 0)                        \
    X(VELOCITY_NUMERATOR, 0x6096, 1, U32, R | W, 1, 1, UINT32_MAX)             \
    X(VELOCITY_DIVISOR, 0x6096, 2, U32, R | W, 1, 1, UINT32_MAX)               \
    X(HOMING_METHOD, 0x6098, 0, I8, R | W, 0, 0, 0)                            \
    X(HOMING_SPEED_COUNT, 0x6099, 0, U8, R, 2, 0, 0)                           \
    X(HOMING_FAST, 0x6099, 1, U32, R | W, 10000, 1, UINT32_MAX)                \
    X(HOMING_SLOW, 0x6099, 2, U32, R | W, 1000, 1, UINT32_MAX)                 \
    X(HOMING_ACCELERATION, 0x609A, 0, U32, R | W, 1, 1, UINT32_MAX)            \
    X(POSITION_OFFSET, 0x60B0, 0, I32, R | W | P, 0, 0, 0)                     \
    X(VELOCITY_OFFSET, 0x60B1, 0, I32, R | W | P, 0, 0, 0)                     \
    X(TORQUE_OFFSET, 0x60B2, 0, I16, R | W | P, 0, 0, 0)                       \
    X(PROBE_FUNCTION, 0x60B8, 0, U16, R | W | P, 0, 0, 0)                      \
    X(PROBE_STATUS, 0x60B9, 0, U16, R | T, 0, 0, 0)                            \
    X(PROBE_RISING, 0x60BA, 0, I32, R | T, 0, 0, 0)                            \
    X(PROBE_FALLING, 0x60BB, 0, I32, R | T, 0, 0, 0)                           \
    X(INTERPOLATION_MODE, 0x60C0, 0, I16, R | W, 0, 0, 0)                      \
    X(INTERPOLATION_DATA_COUNT, 0x60C1, 0, U8, R, 1, 0, 0)                     \
    X(INTERPOLATION_TARGET, 0x60C1, 1, I32, R | W | P, 0, 0, 0)                \
    X(INTERPOLATION_COUNT, 0x60C2, 0, U8, R, 2, 0, 0)                          \
    X(INTERPOLATION_TIME, 0x60C2, 1, U8, R | W, 0, 0, 0)                       \
    X(INTERPOLATION_EXPONENT, 0x60C2, 2, I8, R | W, -3, -6, 0)                 \
    X(ACCELERATION_MAX, 0x60C5, 0, U32, R | W | P, UINT32_MAX, 0, 0)           \
    X(DECELERATION_MAX, 0x60C6, 0, U32, R | W | P, UINT32_MAX, 0, 0)           \
    X(FOLLOWING_ERROR, 0x60F4, 0, I32, R | T, 0, 0, 0)                         \
    X(INPUTS, 0x60FD, 0, U32, R | T, 0, 0, 0)                                  \
    X(TARGET_VELOCITY, 0x60FF, 0, I32, R | W | P, 0, 0, 0)                     \
    X(MODES, 0x6502, 0, U32, R, 0x1E5, 0, 0)                                   \
    X(AXIS_TYPE, 0x67FF, 0, U32, R, 0x00020192, 0, 0)

#define CIA402_ROWS(X)                                                         \
    CIA402_DUMMY_ROWS(X)                                                       \
    CIA402_COM_ROWS(X)                                                         \
    CIA402_RPDO_ROWS(X)                                                        \
    CIA402_TPDO_ROWS(X)                                                        \
    CIA402_MAKER_ROWS(X)                                                       \
    CIA402_DRIVE_ROWS(X)

#endif
