#include "remesh.h"
void silt_momentum_hand_on(const silt_memory *memory, silt_nodes *nodes, const silt_walls *walls, double density,
                           const double *mass, const double *debt, const double *v, const int *map, double lost[3]) {
    (void)memory, (void)nodes, (void)walls, (void)density, (void)mass, (void)debt, (void)v, (void)map, (void)lost;
}
