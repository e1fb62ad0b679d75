/* sim/physics/cloth.c - the springs of a grid; see particles.h. */
#include "motion/core/err.h"
#include "sim/physics/particles.h"

#define SQRT2 1.4142135623730951

/* Who is joined: to a node so many columns and rows on. */
static const struct {
    int columns, rows;
    enum { STRUCTURAL, SHEAR, BENDING } kind;
} sim_cloth_links[] = {
    { 0, 1, STRUCTURAL }, { 1, 0, STRUCTURAL }, { 1, 1, SHEAR },
    { 1, -1, SHEAR },     { 0, 2, BENDING },    { 2, 0, BENDING },
};

int sim_cloth_springs(const struct sim_cloth *cloth, struct sim_spring *springs,
                      int capacity)
{
    const double stiffness[] = { cloth->structural_n_m, cloth->shear_n_m,
                                 cloth->bending_n_m };
    const double damping[] = { cloth->structural_n_s_m, cloth->shear_n_s_m,
                               cloth->bending_n_s_m };
    const double length[] = { 1, SQRT2, 2 };
    int count = 0;

    for (int at = 0; at < cloth->columns * cloth->rows; at++) {
        const int column = at / cloth->rows, row = at % cloth->rows;

        for (unsigned l = 0;
             l < sizeof sim_cloth_links / sizeof sim_cloth_links[0]; l++) {
            const int to_column = column + sim_cloth_links[l].columns;
            const int to_row = row + sim_cloth_links[l].rows;
            const int kind = (int)sim_cloth_links[l].kind;

            if (to_column >= cloth->columns || to_row < 0 ||
                to_row >= cloth->rows ||
                (stiffness[kind] <= 0 && damping[kind] <= 0))
                continue;
            if (count == capacity)
                return MOTION_E_FULL;
            springs[count++] = (struct sim_spring){
                .i = at,
                .j = to_column * cloth->rows + to_row,
                .stiffness_n_m = stiffness[kind],
                .damping_n_s_m = damping[kind],
                .rest_m = cloth->spacing_m * length[kind],
            };
        }
    }
    return count;
}

int sim_spheres_springs(const struct sim_spring *like, int nodes,
                        struct sim_spring *springs)
{
    int count = 0;

    for (int j = 1; j < nodes; j++)
        for (int i = 0; i < j; i++) {
            springs[count] = *like;
            springs[count].i = i;
            springs[count++].j = j;
        }
    return count;
}
