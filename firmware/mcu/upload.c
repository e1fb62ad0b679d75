/* firmware/mcu/upload.c - see upload.h. */
#include "firmware/mcu/upload.h"

#include "hal/mcu/map.h"

void mcu_upload_init(struct mcu_upload *upload, struct mcu_unit *unit)
{
    *upload = (struct mcu_upload){ .unit = unit };
}

/* A piece whose checksum is right, taken apart. */
struct upload_piece {
    uint16_t kind;
    unsigned axis;
    uint32_t id, number, crc;
    const uint16_t *content;
    unsigned words;
};

static bool upload_has_bit(uint16_t axes, unsigned axis)
{
    return (axes >> axis & 1) != 0;
}

/* --- axes ----------------------------------------------------------------- */

/* All axes have come: they replace those there are. */
static enum mcu_piece_result upload_set_up(struct mcu_upload *upload)
{
    int err;

    mcu_unit_hold(upload->unit);
    err = mcu_unit_set_up(upload->unit, upload->setup_count, upload->setup,
                          upload->driven);
    mcu_unit_release(upload->unit);
    if (err < 0) {
        upload->setup_id = upload->drives_id = 0;
        return err == MOTION_E_STATE ? MCU_PIECE_E_STATE : MCU_PIECE_E_VALUE;
    }
    upload->move_id = 0;
    upload->head_axes = 0;
    return MCU_PIECE_TAKEN;
}

static struct mcu_servo *upload_servo(const struct mcu_upload *upload,
                                      unsigned axis)
{
    return &upload->unit->config->servos->servo[axis];
}

/* Has the drive come that this axis is meant for? */
static bool upload_has_drive(const struct mcu_upload *upload,
                             const struct upload_piece *piece, uint32_t crc)
{
    return upload->drives_id == piece->id &&
           upload_has_bit(upload->drive_axes, piece->axis) &&
           upload_servo(upload, piece->axis)->crc == crc;
}

static enum mcu_piece_result upload_put_setup(struct mcu_upload *upload,
                                              const struct upload_piece *piece)
{
    const unsigned axis = piece->axis;
    struct mcu_setup setup;
    uint32_t drive_crc;
    uint16_t all, bit;

    if (piece->words != MCU_PIECE_SETUP_WORDS)
        return MCU_PIECE_E_LENGTH;
    if (piece->number < 1 || piece->number > MCU_AXES_MAX ||
        axis >= piece->number)
        return MCU_PIECE_E_AXIS;
    if (piece->id == upload->setup_id &&
        upload_has_bit(upload->setup_axes, axis))
        return upload->setup_crc[axis] == piece->crc ? MCU_PIECE_REPEATED
                                                     : MCU_PIECE_E_MOVE;
    if (upload->unit->axis_count > 0 &&
        (upload->unit->controller.state != CONTROLLER_OFF ||
         upload->unit->controller.enabling))
        return MCU_PIECE_E_STATE;
    drive_crc = mcu_piece_get_setup(piece->content, &setup);
    if (drive_crc != 0 && !upload_has_drive(upload, piece, drive_crc))
        return MCU_PIECE_E_ORDER;
    if (piece->id != upload->setup_id || piece->number != upload->setup_count) {
        upload->setup_id = piece->id;
        upload->setup_count = piece->number;
        upload->setup_axes = 0;
    }
    bit = (uint16_t)(1u << axis);
    upload->setup[axis] = setup;
    upload->setup_crc[axis] = piece->crc;
    upload->setup_axes |= bit;
    upload->driven = (uint16_t)(drive_crc != 0 ? upload->driven | bit
                                               : upload->driven & ~bit);
    all = (uint16_t)((1u << upload->setup_count) - 1);
    return upload->setup_axes == all ? upload_set_up(upload) : MCU_PIECE_TAKEN;
}

/* --- drives --------------------------------------------------------------- */

/* The drives of before are polled by the map that is about to change: with the
 * first piece of others there are no axes until these are set up. */
static enum mcu_piece_result upload_open_drives(struct mcu_upload *upload,
                                                uint32_t id)
{
    struct mcu_unit *unit = upload->unit;
    int err;

    if (unit->config->servos == NULL)
        return MCU_PIECE_E_KIND;
    if (id == upload->drives_id)
        return MCU_PIECE_TAKEN;
    mcu_unit_hold(unit);
    err = mcu_unit_clear(unit);
    if (err == MOTION_OK)
        mcu_servos_clear(unit->config->servos);
    mcu_unit_release(unit);
    if (err < 0)
        return MCU_PIECE_E_STATE;
    upload->setup_id = upload->drives_id = id;
    upload->setup_count = 0;
    upload->setup_axes = upload->head_axes = upload->drive_axes = 0;
    upload->move_id = 0;
    return MCU_PIECE_TAKEN;
}

/* Once a drive has come, the map is whole. */
static enum mcu_piece_result upload_put_map(struct mcu_upload *upload,
                                            const struct upload_piece *piece)
{
    const unsigned count = piece->words / 4;
    const enum mcu_piece_result opened = upload_open_drives(upload, piece->id);
    struct modbus_map *map;
    bool is_same = true;

    if (opened != MCU_PIECE_TAKEN)
        return opened;
    if (piece->words != 4 * count || piece->axis != 0 ||
        piece->number >= MCU_MAP_VALUES ||
        count > MCU_MAP_VALUES - piece->number)
        return MCU_PIECE_E_LENGTH;
    map = &upload->unit->config->servos->map;
    for (unsigned i = 0; i < count; i++)
        is_same = is_same && mcu_map_get(map, piece->number + i) ==
                                 mcu_piece_get_value(piece->content, i);
    if (is_same)
        return MCU_PIECE_REPEATED;
    if (upload->drive_axes != 0)
        return MCU_PIECE_E_MOVE;
    for (unsigned i = 0; i < count; i++)
        if (!mcu_map_set(map, piece->number + i,
                         mcu_piece_get_value(piece->content, i)))
            return MCU_PIECE_E_VALUE;
    return MCU_PIECE_TAKEN;
}

static enum mcu_piece_result upload_put_drive(struct mcu_upload *upload,
                                              const struct upload_piece *piece)
{
    const enum mcu_piece_result opened = upload_open_drives(upload, piece->id);
    struct mcu_servo servo;

    if (opened != MCU_PIECE_TAKEN)
        return opened;
    if (piece->axis >= MCU_AXES_MAX)
        return MCU_PIECE_E_AXIS;
    if (upload_has_bit(upload->drive_axes, piece->axis))
        return upload_servo(upload, piece->axis)->crc == piece->crc
                   ? MCU_PIECE_REPEATED
                   : MCU_PIECE_E_MOVE;
    if (piece->number != 0 ||
        !mcu_piece_get_drive(piece->content, piece->words, &servo))
        return MCU_PIECE_E_VALUE;
    if (servo.map_crc != mcu_map_crc(&upload->unit->config->servos->map))
        return MCU_PIECE_E_ORDER;
    if (!mcu_servo_is_sound(upload->unit->config->servos, &servo))
        return MCU_PIECE_E_VALUE;
    servo.crc = piece->crc;
    *upload_servo(upload, piece->axis) = servo;
    upload->drive_axes |= (uint16_t)(1u << piece->axis);
    return MCU_PIECE_TAKEN;
}

/* --- moves ---------------------------------------------------------------- */

/* From the first head of another move on there is nothing of the one before. */
static void upload_new_move(struct mcu_upload *upload, uint32_t id)
{
    struct mcu_unit *unit = upload->unit;

    mcu_unit_hold(unit);
    for (unsigned i = 0; i < unit->axis_count; i++)
        mcu_window_init(&unit->window[i], unit->window[i].ring,
                        unit->window[i].capacity);
    mcu_unit_release(unit);
    upload->move_id = id;
    upload->head_axes = 0;
}

static enum mcu_piece_result upload_put_head(struct mcu_upload *upload,
                                             const struct upload_piece *piece)
{
    const unsigned axis = piece->axis;
    struct mcu_head head;

    if (piece->words != MCU_PIECE_HEAD_OF_WORDS)
        return MCU_PIECE_E_LENGTH;
    if (axis >= upload->unit->axis_count)
        return MCU_PIECE_E_AXIS;
    if (piece->number != 0)
        return MCU_PIECE_E_ORDER;
    if (piece->id == upload->move_id && upload_has_bit(upload->head_axes, axis))
        return upload->head_crc[axis] == piece->crc ? MCU_PIECE_REPEATED
                                                    : MCU_PIECE_E_MOVE;
    if (mcu_unit_is_moving(upload->unit))
        return MCU_PIECE_E_STATE;
    mcu_piece_get_head(piece->content, &head);
    if (mcu_words_get(piece->content, 4) > UINT32_MAX ||
        !mcu_head_is_sound(&head))
        return MCU_PIECE_E_VALUE;
    if (piece->id != upload->move_id)
        upload_new_move(upload, piece->id);
    mcu_unit_hold(upload->unit);
    mcu_window_open(&upload->unit->window[axis], &head);
    mcu_unit_release(upload->unit);
    upload->head_crc[axis] = piece->crc;
    upload->head_axes |= (uint16_t)(1u << axis);
    return MCU_PIECE_TAKEN;
}

static enum mcu_piece_result upload_result(int err)
{
    switch (err) {
    case MOTION_OK:
        return MCU_PIECE_TAKEN;
    case MOTION_E_FULL:
        return MCU_PIECE_E_FULL;
    case MOTION_E_ORDER:
        return MCU_PIECE_E_ORDER;
    case MOTION_E_DISCONTINUITY:
        return MCU_PIECE_E_GAP;
    case MOTION_E_LIMIT:
        return MCU_PIECE_E_LIMIT;
    default:
        return MCU_PIECE_E_VALUE;
    }
}

static enum mcu_piece_result upload_put_track(struct mcu_upload *upload,
                                              const struct upload_piece *piece)
{
    const unsigned count = piece->words / MCU_PIECE_TRACK_WORDS;
    struct motion_segment segment[MCU_PIECE_SEGMENTS];
    struct mcu_window *window;

    if (count < 1 || count > MCU_PIECE_SEGMENTS ||
        piece->words != count * MCU_PIECE_TRACK_WORDS)
        return MCU_PIECE_E_LENGTH;
    if (piece->axis >= upload->unit->axis_count)
        return MCU_PIECE_E_AXIS;
    if (piece->id != upload->move_id ||
        !upload_has_bit(upload->head_axes, piece->axis))
        return MCU_PIECE_E_MOVE;
    window = &upload->unit->window[piece->axis];
    for (unsigned i = 0; i < count; i++)
        mcu_piece_get_segment(
            piece->content + (size_t)i * MCU_PIECE_TRACK_WORDS, &segment[i]);
    if (piece->number < window->filled &&
        count <= window->filled - piece->number)
        return mcu_window_has(window, piece->number, segment, count)
                   ? MCU_PIECE_REPEATED
                   : MCU_PIECE_E_MOVE;
    if (piece->number != window->filled)
        return MCU_PIECE_E_ORDER;
    return upload_result(mcu_window_put(window, segment, count));
}

/* --- any ------------------------------------------------------------------ */

static enum mcu_piece_result upload_take(struct mcu_upload *upload,
                                         const uint16_t word[], unsigned count)
{
    static enum mcu_piece_result (*const put[])(struct mcu_upload *,
                                                const struct upload_piece *) = {
        [MCU_PIECE_SETUP] = upload_put_setup,
        [MCU_PIECE_HEAD_OF] = upload_put_head,
        [MCU_PIECE_TRACK] = upload_put_track,
        [MCU_PIECE_MAP] = upload_put_map,
        [MCU_PIECE_DRIVE] = upload_put_drive,
    };
    struct upload_piece piece;

    if (count <= MCU_PIECE_AROUND || count > MCU_PIECE_MAX)
        return MCU_PIECE_E_LENGTH;
    piece.crc = mcu_piece_crc(word, count - 2);
    if (piece.crc != mcu_words_get(word + count - 2, 2))
        return MCU_PIECE_E_CHECKSUM;
    piece.kind = word[0];
    piece.axis = word[1];
    piece.id = (uint32_t)mcu_words_get(word + 2, 2);
    piece.number = (uint32_t)mcu_words_get(word + 4, 2);
    piece.content = word + MCU_PIECE_HEAD;
    piece.words = count - MCU_PIECE_AROUND;
    if (piece.kind < MCU_PIECE_SETUP || piece.kind > MCU_PIECE_DRIVE)
        return MCU_PIECE_E_KIND;
    return piece.id == 0 ? MCU_PIECE_E_MOVE : put[piece.kind](upload, &piece);
}

enum mcu_piece_result mcu_upload_put(struct mcu_upload *upload,
                                     const uint16_t piece[], unsigned count)
{
    upload->last = upload_take(upload, piece, count);
    if (mcu_piece_exception(upload->last) == 0)
        upload->taken++;
    else
        upload->refused++;
    return upload->last;
}

bool mcu_upload_has(const struct mcu_upload *upload, uint32_t move_id)
{
    const uint16_t all = (uint16_t)((1u << upload->unit->axis_count) - 1);

    if (move_id == 0 || move_id != upload->move_id || upload->head_axes != all)
        return false;
    for (unsigned i = 0; i < upload->unit->axis_count; i++)
        if (!mcu_window_is_ready(&upload->unit->window[i]))
            return false;
    return true;
}
