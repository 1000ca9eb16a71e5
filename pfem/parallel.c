// how many threads loops may take
#include "parallel.h"

static int threads_asked; // 0: nobody has said yet

void silt_threads_ask(int n) {
    static int all;
    if (all == 0) // before it is set to one below, or by BLAS
        all = omp_get_max_threads();
    const int wanted = n > 0 ? n : all;
    threads_asked = wanted < PARALLEL_MOST ? wanted : PARALLEL_MOST;
    omp_set_num_threads(1);
}

int silt_threads_asked(void) {
    if (threads_asked == 0)
        silt_threads_ask(0);
    return threads_asked;
}
