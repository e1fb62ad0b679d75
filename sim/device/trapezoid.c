/* sim/device/trapezoid.c - see trapezoid.h. */
#include "sim/device/trapezoid.h"

/* Displacement and speed are counted towards `to`: an axis that runs away from it has a
 * negative speed and brakes first. */
bool sim_trapezoid_step(const struct sim_trapezoid *shape, double to,
                        double dt_s, double *pos, double *vel)
{
    const double sign = to < *pos ? -1 : 1;
    const double distance = (to - *pos) * sign;
    double speed = *vel * sign;
    /* to rest, after one more step at this speed */
    const double stop = speed * dt_s + speed * speed / (2 * shape->dec);

    if (speed < 0)
        speed += shape->dec * dt_s;
    else if (stop >= distance)
        speed -= shape->dec * dt_s;
    else
        speed += shape->acc * dt_s;
    if (speed > shape->vel_max)
        speed = shape->vel_max;
    if (*vel * sign >= 0 && (speed * dt_s >= distance || speed <= 0)) {
        *pos = to;
        *vel = 0;
        return true;
    }
    *pos += speed * sign * dt_s;
    *vel = speed * sign;
    return false;
}

bool sim_trapezoid_speed(const struct sim_trapezoid *shape, double to,
                         double dt_s, double *pos, double *vel)
{
    const double step = shape->acc * dt_s;
    const double off = to - *vel;

    if (off > step)
        *vel += step;
    else if (off < -step)
        *vel -= step;
    else
        *vel = to;
    *pos += *vel * dt_s;
    return off <= step && off >= -step;
}
