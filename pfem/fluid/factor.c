// sparse symmetric factors by CHOLMOD
#include "factor.h"

#include <cholmod.h>
#include <dlfcn.h>
#include <omp.h>

struct silt_factor_inside {
    cholmod_common common;
    cholmod_sparse *matrix; // owned
    cholmod_factor *factor; // owned
    cholmod_dense *solution, *work_y, *work_e; // owned
};

static struct silt_factor_inside *inside_create(void) {
    struct silt_factor_inside *q = silt_alloc(1, sizeof *q);
    cholmod_start(&q->common);
    q->common.print = 0;
    q->common.nmethods = 1;
    q->common.postorder = 1;
    q->common.quick_return_if_not_posdef = 1;
    // one BLAS thread: its results depend on the number of threads
    void (*threads)(int);
    *(void **)&threads = dlsym(RTLD_DEFAULT, "openblas_set_num_threads");
    if (threads)
        threads(1);
    return q;
}

void silt_factor_clear(silt_factor *f) {
    struct silt_factor_inside *q = f->inside;
    if (q) {
        cholmod_free_factor(&q->factor, &q->common);
        cholmod_free_sparse(&q->matrix, &q->common);
        cholmod_free_dense(&q->solution, &q->common);
        cholmod_free_dense(&q->work_y, &q->common);
        cholmod_free_dense(&q->work_e, &q->common);
        cholmod_finish(&q->common);
        free(q);
    }
    *f = (silt_factor){0};
}

int *silt_factor_pattern(silt_factor *f, int n, int filled) {
    if (!f->inside)
        f->inside = inside_create();
    struct silt_factor_inside *q = f->inside;
    cholmod_free_factor(&q->factor, &q->common);
    cholmod_free_sparse(&q->matrix, &q->common);
    q->matrix = cholmod_allocate_sparse((size_t)n, (size_t)n, (size_t)filled, 1, 1, -1, CHOLMOD_REAL, &q->common);
    memset(q->matrix->x, 0, (size_t)filled * sizeof(double));
    f->n = n;
    f->start = q->matrix->p;
    f->index = q->matrix->i;
    f->value = q->matrix->x;
    return q->matrix->p;
}

void silt_factor_analyse(silt_factor *f) {
    struct silt_factor_inside *q = f->inside;
    q->common.method[0].ordering = CHOLMOD_AMD;
    q->common.supernodal = CHOLMOD_AUTO;
    cholmod_free_factor(&q->factor, &q->common);
    q->factor = cholmod_analyze(q->matrix, &q->common);
}

bool silt_factor_compute(silt_factor *f) {
    struct silt_factor_inside *q = f->inside;
    f->bad = 0;
    if (!q || !q->factor)
        return false;
    // CHOLMOD's own loops want four threads whatever there is, and wait for each other more than they work
    const int levels = omp_get_max_active_levels();
    omp_set_max_active_levels(0);
    const int done = cholmod_factorize(q->matrix, q->factor, &q->common);
    omp_set_max_active_levels(levels);
    if (done && q->common.status != CHOLMOD_NOT_POSDEF)
        return true;
    const size_t minor = q->factor->minor;
    f->bad = minor < (size_t)f->n ? ((int *)q->factor->Perm)[minor] : 0;
    return false;
}

bool silt_factor_solve(silt_factor *f, const double *right, double *out) {
    struct silt_factor_inside *q = f->inside;
    const size_t n = (size_t)f->n;
    cholmod_dense b = {.nrow = n, .ncol = 1, .nzmax = n, .d = n, .x = (void *)(uintptr_t)right, .xtype = CHOLMOD_REAL,
                       .dtype = CHOLMOD_DOUBLE};
    if (!cholmod_solve2(CHOLMOD_A, q->factor, &b, NULL, &q->solution, NULL, &q->work_y, &q->work_e, &q->common))
        return false;
    memcpy(out, q->solution->x, n * sizeof *out);
    return true;
}
