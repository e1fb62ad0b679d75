/* hal/mcu/piece.c - see piece.h. */
#include "hal/mcu/piece.h"

#include "hal/mcu/map.h"
#include "hal/support/crc32.h"

static const uint8_t piece_exception[] = {
#define PIECE_ROW(name, value, exception, text) [value] = (exception),
    MCU_PIECE_LIST(PIECE_ROW)
#undef PIECE_ROW
};

uint8_t mcu_piece_exception(enum mcu_piece_result result)
{
    return piece_exception[result];
}

uint16_t *mcu_words_put(uint16_t *to, uint64_t value, unsigned words)
{
    for (unsigned i = 0; i < words; i++)
        *to++ = (uint16_t)(value >> 16 * i);
    return to;
}

uint64_t mcu_words_get(const uint16_t *from, unsigned words)
{
    uint64_t value = 0;

    for (unsigned i = 0; i < words; i++)
        value |= (uint64_t)from[i] << 16 * i;
    return value;
}

uint32_t mcu_piece_crc(const uint16_t piece[], unsigned count)
{
    uint32_t crc = 0;

    for (unsigned i = 0; i < count; i++) {
        const uint8_t byte[2] = { (uint8_t)(piece[i] >> 8), (uint8_t)piece[i] };
        crc = crc32_of(crc, byte, sizeof byte);
    }
    return crc;
}

/* Values of a drive before its parameters. */
#define PIECE_DRIVE_FIXED 12

/* --- written -------------------------------------------------------------- */

static uint16_t *piece_begin(uint16_t piece[MCU_PIECE_MAX],
                             enum mcu_piece_kind kind, unsigned axis,
                             uint32_t id, uint32_t number)
{
    uint16_t *to = mcu_words_put(piece, kind, 1);

    to = mcu_words_put(to, axis, 1);
    to = mcu_words_put(to, id, 2);
    return mcu_words_put(to, number, 2);
}

static unsigned piece_end(uint16_t piece[MCU_PIECE_MAX], const uint16_t *to)
{
    const unsigned count = (unsigned)(to - piece);

    mcu_words_put(piece + count, mcu_piece_crc(piece, count), 2);
    return count + 2;
}

static uint16_t *piece_put_i64(uint16_t *to, const int64_t *value,
                               unsigned count)
{
    for (unsigned i = 0; i < count; i++)
        to = mcu_words_put(to, (uint64_t)value[i], 4);
    return to;
}

int64_t mcu_piece_get_value(const uint16_t *content, unsigned i)
{
    return (int64_t)mcu_words_get(content + (size_t)4 * i, 4);
}

static void piece_get_i64(const uint16_t *from, int64_t *value, unsigned count)
{
    for (unsigned i = 0; i < count; i++)
        value[i] = mcu_piece_get_value(from, i);
}

unsigned mcu_piece_put_setup(uint16_t piece[MCU_PIECE_MAX], uint32_t setup_id,
                             unsigned axis, unsigned axis_count,
                             const struct mcu_setup *setup, uint32_t drive_crc)
{
    const int64_t value[] = {
        setup->pos_min_q32,    setup->pos_max_q32,   setup->vel_q32,
        setup->acc_q32,        setup->jerk_q32,      setup->stop_vel_q32,
        setup->stop_acc_q32,   setup->stop_jerk_q32, setup->following_floor_q32,
        setup->following_k_ns, setup->pos_q32,       drive_crc,
    };
    uint16_t *to =
        piece_begin(piece, MCU_PIECE_SETUP, axis, setup_id, axis_count);

    return piece_end(piece,
                     piece_put_i64(to, value, sizeof value / sizeof value[0]));
}

uint32_t mcu_piece_get_setup(const uint16_t *content, struct mcu_setup *setup)
{
    int64_t value[MCU_PIECE_SETUP_WORDS / 4];

    piece_get_i64(content, value, MCU_PIECE_SETUP_WORDS / 4);
    *setup = (struct mcu_setup){
        .pos_min_q32 = value[0],
        .pos_max_q32 = value[1],
        .vel_q32 = value[2],
        .acc_q32 = value[3],
        .jerk_q32 = value[4],
        .stop_vel_q32 = value[5],
        .stop_acc_q32 = value[6],
        .stop_jerk_q32 = value[7],
        .following_floor_q32 = value[8],
        .following_k_ns = value[9],
        .pos_q32 = value[10],
    };
    return (uint32_t)value[11];
}

unsigned mcu_piece_put_map(uint16_t piece[MCU_PIECE_MAX], uint32_t setup_id,
                           unsigned from, const struct modbus_map *map,
                           unsigned *count)
{
    int64_t value[MCU_PIECE_VALUES] = { 0 };
    uint16_t *to = piece_begin(piece, MCU_PIECE_MAP, 0, setup_id, from);

    *count = 0;
    for (unsigned i = 0; i < MCU_PIECE_VALUES && from + i < MCU_MAP_VALUES;
         i++) {
        value[i] = mcu_map_get(map, from + i);
        if (value[i] != 0)
            *count = i + 1;
    }
    return piece_end(piece, piece_put_i64(to, value, *count));
}

unsigned mcu_piece_put_drive(uint16_t piece[MCU_PIECE_MAX], uint32_t setup_id,
                             unsigned axis, const struct mcu_servo *servo)
{
    const struct drive_modbus_config *config = &servo->config;
    int64_t value[MCU_PIECE_VALUES] = {
        config->unit,
        config->counts_num,
        config->counts_den,
        config->vel_max_q32,
        config->acc_q32,
        config->cycle_ns,
        config->latency_ns,
        config->first_step_max_q32,
        servo->depth,
        servo->map_crc,
        servo->feedback_max_age_ns,
        config->parameter_count,
    };
    uint16_t *to = piece_begin(piece, MCU_PIECE_DRIVE, axis, setup_id, 0);
    unsigned count = PIECE_DRIVE_FIXED;

    for (unsigned i = 0; i < config->parameter_count; i++) {
        value[count++] = servo->parameter[i].item;
        value[count++] = servo->parameter[i].value;
    }
    return piece_end(piece, piece_put_i64(to, value, count));
}

uint32_t mcu_piece_own_crc(const uint16_t piece[], unsigned count)
{
    return (uint32_t)mcu_words_get(piece + count - 2, 2);
}

bool mcu_piece_get_drive(const uint16_t *content, unsigned words,
                         struct mcu_servo *servo)
{
    int64_t value[MCU_PIECE_VALUES] = { 0 };
    struct drive_modbus_config *config = &servo->config;
    unsigned at = PIECE_DRIVE_FIXED;

    piece_get_i64(content, value, words / 4);
    if (words / 4 < PIECE_DRIVE_FIXED || value[0] < 1 || value[0] > UINT8_MAX ||
        value[8] < 2 || value[8] > HAL_MODBUS_MAILBOX || value[11] < 0 ||
        value[11] > MCU_SERVO_PARAMETERS ||
        words / 4 != PIECE_DRIVE_FIXED + 2 * (unsigned)value[11])
        return false;
    *servo = (struct mcu_servo){
        .config = { .unit = (uint8_t)value[0],
                    .counts_num = value[1],
                    .counts_den = value[2],
                    .vel_max_q32 = value[3],
                    .acc_q32 = value[4],
                    .cycle_ns = value[5],
                    .latency_ns = value[6],
                    .first_step_max_q32 = value[7],
                    .mode = HAL_DRIVE_STREAM_POSITION,
                    .parameter_count = (unsigned)value[11] },
        .depth = (unsigned)value[8],
        .map_crc = (uint32_t)value[9],
        .feedback_max_age_ns = value[10],
    };
    for (unsigned i = 0; i < config->parameter_count; i++) {
        if (value[at] < 0 || value[at] >= MODBUS_MAP_ITEMS_MAX)
            return false;
        servo->parameter[i].item = (uint8_t)value[at++];
        servo->parameter[i].value = value[at++];
    }
    return true;
}

void mcu_head_of(const struct motion_track *track, struct mcu_head *head)
{
    *head = (struct mcu_head){ .end_ns_q12 = track->end_ns_q12,
                               .end = track->end,
                               .end_frac = track->end_frac,
                               .outline.count = track->count };
    if (track->outline != NULL) {
        head->outline = *track->outline;
        return;
    }
    for (int i = MOTION_POS; i <= MOTION_JERK && track->count > 0; i++)
        head->outline.extreme[i] =
            (struct motion_extreme){ .min = INT64_MAX, .max = INT64_MIN };
    for (uint32_t i = 0; i < track->count; i++) {
        struct motion_extreme one[MOTION_JERK + 1];

        motion_segment_extremes(&track->segment[i], one);
        for (int k = MOTION_POS; k <= MOTION_JERK; k++)
            motion_extreme_extend(&head->outline.extreme[k], &one[k]);
    }
}

unsigned mcu_piece_put_head(uint16_t piece[MCU_PIECE_MAX], uint32_t move_id,
                            unsigned axis, const struct mcu_head *head)
{
    const int64_t end[] = { head->end_ns_q12, head->end.pos_q32,
                            head->end.vel_q32, head->end.acc_q32,
                            head->end.jerk_q32 };
    uint16_t *to = piece_begin(piece, MCU_PIECE_HEAD_OF, axis, move_id, 0);

    to = mcu_words_put(to, head->outline.count, 4);
    to = piece_put_i64(to, end, sizeof end / sizeof end[0]);
    to = mcu_words_put(to, head->end_frac, 4);
    for (int i = MOTION_POS; i <= MOTION_JERK; i++) {
        const struct motion_extreme *of = &head->outline.extreme[i];
        const int64_t extreme[] = { of->min, of->max, of->min_ns_q12,
                                    of->max_ns_q12 };
        to = piece_put_i64(to, extreme, 4);
    }
    return piece_end(piece, to);
}

void mcu_piece_get_head(const uint16_t *content, struct mcu_head *head)
{
    int64_t value[MCU_PIECE_HEAD_OF_WORDS / 4];

    piece_get_i64(content, value, MCU_PIECE_HEAD_OF_WORDS / 4);
    *head = (struct mcu_head){
        .end_ns_q12 = value[1],
        .end = { value[2], value[3], value[4], value[5] },
        .end_frac = (uint64_t)value[6],
        .outline.count = (uint32_t)value[0],
    };
    for (int i = MOTION_POS; i <= MOTION_JERK; i++) {
        const int64_t *of = &value[7 + 4 * i];
        head->outline.extreme[i] =
            (struct motion_extreme){ of[0], of[1], of[2], of[3] };
    }
}

unsigned mcu_piece_put_track(uint16_t piece[MCU_PIECE_MAX], uint32_t move_id,
                             unsigned axis, uint32_t number,
                             const struct motion_segment segment[],
                             unsigned count)
{
    uint16_t *to = piece_begin(piece, MCU_PIECE_TRACK, axis, move_id, number);

    for (unsigned i = 0; i < count; i++) {
        to = mcu_words_put(to, (uint64_t)segment[i].dur_ns_q12, 4);
        to = mcu_words_put(to, (uint64_t)segment[i].pos_q32, 4);
        to = piece_put_i64(to, segment[i].coef, MOTION_TRACK_DEGREE + 1);
        to = mcu_words_put(to, (uint32_t)segment[i].remainder, 2);
        to = mcu_words_put(to, (uint64_t)segment[i].frac, 1);
    }
    return piece_end(piece, to);
}

void mcu_piece_get_segment(const uint16_t *content,
                           struct motion_segment *segment)
{
    *segment = (struct motion_segment){ 0 };
    segment->dur_ns_q12 = (int64_t)mcu_words_get(content, 4);
    segment->pos_q32 = (int64_t)mcu_words_get(content + 4, 4);
    piece_get_i64(content + 8, segment->coef, MOTION_TRACK_DEGREE + 1);
    segment->remainder = (int32_t)mcu_words_get(content + 32, 2);
    segment->frac = (int8_t)content[34];
}
