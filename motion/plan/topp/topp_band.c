/* motion/plan/topp/topp_band.c - see topp_band.h. */
#include "motion/plan/topp/topp_band.h"

#include <math.h>

bool topp_band_solve(uint32_t n, double (*m)[3], const double gradient[],
                     double x[])
{
    for (uint32_t i = 0; i < n; i++) {
        double two = 0, one = 0;
        if (i >= 2) {
            two = m[i][2];
            m[i][2] = two / m[i - 2][0];
        }
        if (i >= 1) {
            one = m[i][1] - (i >= 2 ? two * m[i - 1][1] : 0);
            m[i][1] = one / m[i - 1][0];
        }
        m[i][0] -= two * m[i][2] + one * m[i][1];
        if (!(m[i][0] > 0) || !isfinite(m[i][0]))
            return false;
        x[i] = -gradient[i];
        if (i >= 1)
            x[i] -= m[i][1] * x[i - 1];
        if (i >= 2)
            x[i] -= m[i][2] * x[i - 2];
    }
    for (uint32_t i = 0; i < n; i++)
        x[i] /= m[i][0];
    for (uint32_t i = n; i-- > 0;) {
        if (i + 1 < n)
            x[i] -= m[i + 1][1] * x[i + 1];
        if (i + 2 < n)
            x[i] -= m[i + 2][2] * x[i + 2];
    }
    return true;
}
