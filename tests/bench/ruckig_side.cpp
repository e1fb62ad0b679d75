// tests/bench/ruckig_side.cpp - see ruckig_side.h.
#include "tests/bench/ruckig_side.h"

#include <array>
#include <cmath>

#include <ruckig/ruckig.hpp>

namespace
{

template <std::size_t N> struct side {
    ruckig::Ruckig<N> otg;
    ruckig::InputParameter<N> input;
    ruckig::Trajectory<N> trajectory;
    bool has_answer = false;

    void set(const ruckig_axis *axis)
    {
        std::array<double, N> vel_min, acc_min;
        for (std::size_t i = 0; i < N; i++) {
            input.current_position[i] = axis[i].p0;
            input.current_velocity[i] = axis[i].v0;
            input.current_acceleration[i] = axis[i].a0;
            input.target_position[i] = axis[i].pf;
            input.target_velocity[i] = axis[i].vf;
            input.target_acceleration[i] = axis[i].af;
            input.max_velocity[i] = axis[i].vmax;
            input.max_acceleration[i] = axis[i].amax;
            input.max_jerk[i] = axis[i].jmax;
            vel_min[i] = axis[i].vmin;
            acc_min[i] = axis[i].amin;
        }
        input.min_velocity = vel_min;
        input.min_acceleration = acc_min;
    }

    int plan()
    {
        const auto result = otg.calculate(input, trajectory);
        has_answer = result >= 0;
        return result;
    }

    double sample(double t) const
    {
        std::array<double, N> p, v, a;
        double sum = 0;
        trajectory.at_time(t, p, v, a);
        for (const double each : p)
            sum += each;
        return sum;
    }

    double duration() const
    {
        return has_answer ? trajectory.get_duration() : NAN;
    }
};

side<1> one;
side<3> three;
side<7> seven;

template <typename F> auto with(int axes, F f)
{
    return axes == 1 ? f(one) : axes == 3 ? f(three) : f(seven);
}

} // namespace

void ruckig_set(int axes, const ruckig_axis axis[])
{
    with(axes, [&](auto &side) {
        side.set(axis);
        return 0;
    });
}

int ruckig_plan(int axes)
{
    return with(axes, [](auto &side) { return side.plan(); });
}

double ruckig_duration(int axes)
{
    return with(axes, [](auto &side) { return side.duration(); });
}

double ruckig_sample(int axes, double t)
{
    return with(axes, [&](auto &side) { return side.sample(t); });
}
