// what the worker of the discrete elements holds: edits, grains that become bed, checkpoints; and how it fails

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

#define LOG "test_dem_state.log"
#include "dem_bench.h"

// thousands come and go; ids, positions and forces stay with their grains
static void test_edits(void **unused) {
    (void)unused;
    enum { ROUNDS = 12, LAYER = 500, MOST_GONE = 300 };
    static double at[2 * ROUNDS * LAYER][2], speed[2 * ROUNDS * LAYER];
    silt_dem_def def = plain();
    silt_dem *dem = NULL;
    def.hi[1] = 2;
    OK(silt_dem_open(&dem, &def, &error));
    const int64_t first = 1000000000000;
    int64_t next = first, gone[MOST_GONE + 1];
    double start = silt_seconds();
    const silt_dem_state *s = silt_dem_state_now(dem);
    uint64_t seed = 5;
    memset(speed, 0, sizeof speed);
    for (int round = 0; round < ROUNDS; round++) {
        int n_gone = 0, before = s->n_grain;
        for (int i = 0; i < before - 1 && n_gone < MOST_GONE; i++)
            if (silt_uniform(&seed) < 0.3)
                gone[n_gone++] = s->id[i];
        // the highest one too: its number must not come back
        if (before)
            gone[n_gone++] = s->id[before - 1];
        silt_dem_remove(dem, n_gone, gone);
        for (int i = 0; i < LAYER; i++) {
            silt_dem_sphere g = grain(next, -0.95 + 0.038 * (i % 50), -0.95 + 0.24 * round + 0.024 * (i / 50));
            memcpy(at[next - first], g.x, sizeof *at);
            g.radius = 0.004 + 0.006 * silt_uniform(&seed);
            next += 1 + (i % 3 == 0);
            silt_dem_add(dem, 1, &g);
        }
        s = advance(dem, round % 2, NULL, NULL, NULL);
        assert_int_equal(s->n_grain, before - n_gone + LAYER);
        // every grain is pushed by its id
        double *force = calloc(3 * (size_t)s->n_grain, sizeof *force);
        for (int i = 0; i < s->n_grain; i++) {
            force[3 * i] = s->mass[i] * (double)(s->id[i] % 7);
            speed[s->id[i] - first] += (double)(s->id[i] % 7) * 10 * def.step;
        }
        s = advance(dem, 10, force, NULL, NULL);
        free(force);
        for (int i = 0; i < s->n_grain; i++) {
            int64_t k = s->id[i] - first;
            assert_true(i == 0 || s->id[i] > s->id[i - 1]);
            assert_true(fabs(s->v[3 * i] - speed[k]) < 1e-15 && s->v[3 * i + 1] == 0);
            assert_true(fabs(s->x[3 * i] - at[k][0]) < 1e-5 && s->x[3 * i + 1] == at[k][1]);
        }
        for (int k = 0, i = 0; k < n_gone; k++) {
            while (i < s->n_grain && s->id[i] < gone[k])
                i++;
            assert_true(i == s->n_grain || s->id[i] != gone[k]);
        }
    }
    print_message("%d grains after %d rounds of edits, %.2f s\n", s->n_grain, ROUNDS, silt_seconds() - start);
    // one that leaves the box is absent; removing it afterwards is no error
    silt_dem_sphere g = grain(next++, 0.98, -0.9);
    g.v[0] = 10;
    silt_dem_add(dem, 1, &g);
    int n = advance(dem, 0, NULL, NULL, NULL)->n_grain;
    s = advance(dem, 1000, NULL, NULL, NULL);
    assert_int_equal(s->n_grain, n - 1);
    assert_true(s->id[n - 2] != g.id);
    silt_dem_remove(dem, 1, &g.id);
    n = s->n_grain;
    assert_int_equal(advance(dem, 0, NULL, NULL, NULL)->n_grain, n);
    // wrong ones
    silt_dem_add(dem, 1, &g);
    FAILS(silt_dem_start(dem, 1, NULL, NULL, NULL, &error), "ids must rise");
    silt_dem_close(&dem);
}

// a heap on a frozen bed between two walls; on_bed and contacts by brute force; a grain at rest that becomes a frozen
// sphere in its place does not stir the others
static void test_deposit(void **unused) {
    (void)unused;
    const double walls[2][4] = {{-0.09, 0.5, -0.09, -0.05}, {0.09, -0.05, 0.09, 0.5}};
    silt_dem_def def = plain();
    silt_dem *dem = NULL;
    def.gravity[1] = -9.81;
    def.restitution = 0.2;
    def.rolling_friction = 0.3;
    def.n_wall = 2;
    def.wall = walls;
    OK(silt_dem_open(&dem, &def, &error));
    int64_t id = 0;
    for (int i = 0; i < 12; i++) {
        silt_dem_sphere g = grain(id++, -0.09 + 0.0165 * i, 0);
        g.kind = DEM_FROZEN;
        silt_dem_add(dem, 1, &g);
    }
    for (int i = 0; i < 40; i++) {
        silt_dem_sphere g = grain(id++, -0.075 + 0.0206 * (i % 8) + 0.001 * (i / 8), 0.03 + 0.022 * (i / 8));
        g.radius = 0.009 + 0.00002 * i;
        silt_dem_add(dem, 1, &g);
    }
    const silt_dem_state *s = NULL;
    for (int i = 0; i < 40; i++)
        s = advance(dem, 2500, NULL, NULL, NULL);
    double quiet = 0, after = 0;
    int touching = 0, n_bed = 0;
    assert_int_equal(s->n_grain, 40);
    for (int i = 0; i < s->n_grain; i++) {
        quiet = fmax(quiet, hypot(s->v[3 * i], s->v[3 * i + 1]));
        int count = 0, bed = fabs(fabs(s->x[3 * i]) - 0.09) < s->radius[i];
        count += bed;
        for (int k = 0; k < 12; k++)
            if (hypot(s->x[3 * i] - (-0.09 + 0.0165 * k), s->x[3 * i + 1]) < s->radius[i] + 0.01)
                count++, bed = 1;
        for (int k = 0; k < s->n_grain; k++)
            count += k != i &&
                     hypot(s->x[3 * i] - s->x[3 * k], s->x[3 * i + 1] - s->x[3 * k + 1]) < s->radius[i] + s->radius[k];
        assert_int_equal(s->contacts[i], count);
        assert_int_equal(s->on_bed[i], bed);
        touching += count;
        n_bed += bed;
    }
    // a third of those on the bed stay where they are for good
    for (int i = 0; i < s->n_grain; i++)
        if (s->on_bed[i] && i % 3 == 0) {
            silt_dem_sphere g = grain(id++, s->x[3 * i], s->x[3 * i + 1]);
            g.kind = DEM_FROZEN;
            g.radius = s->radius[i];
            silt_dem_add(dem, 1, &g);
            silt_dem_remove(dem, 1, &s->id[i]);
        }
    int before = s->n_grain;
    for (int k = 0; k < 20; k++) {
        s = advance(dem, 100, NULL, NULL, NULL);
        for (int i = 0; i < s->n_grain; i++)
            after = fmax(after, hypot(s->v[3 * i], s->v[3 * i + 1]));
    }
    print_message("heap: %d contacts, %d on the bed, speed %.1e; %d frozen, then at most %.1e\n", touching, n_bed,
                  quiet, before - s->n_grain, after);
    assert_true(before - s->n_grain > 2 && touching > 60);
    assert_true(quiet < 1e-3);
    assert_true(after < 1e-2);
    silt_dem_close(&dem);
}

static uint64_t fingerprint(const silt_dem_state *s) {
    uint64_t h = silt_hash(0, s->id, (size_t)s->n_grain * sizeof *s->id);
    h = silt_hash(h, s->x, 3 * (size_t)s->n_grain * sizeof(double));
    h = silt_hash(h, s->v, 3 * (size_t)s->n_grain * sizeof(double));
    h = silt_hash(h, s->omega, 3 * (size_t)s->n_grain * sizeof(double));
    h = silt_hash(h, s->radius, (size_t)s->n_grain * sizeof(double));
    h = silt_hash(h, s->mass, (size_t)s->n_grain * sizeof(double));
    h = silt_hash(h, s->contacts, (size_t)s->n_grain * sizeof(int));
    h = silt_hash(h, s->on_bed, (size_t)s->n_grain);
    h = silt_hash(h, s->body_x, 3 * (size_t)s->n_body * sizeof(double));
    h = silt_hash(h, s->body_v, 3 * (size_t)s->n_body * sizeof(double));
    h = silt_hash(h, s->body_omega, 3 * (size_t)s->n_body * sizeof(double));
    return silt_hash(h, s->body_q, 4 * (size_t)s->n_body * sizeof(double));
}

// grains, frozen spheres, a fixed and a free body, a plane and a mesh, all in contact
static void crowd(silt_dem *dem, int64_t *id) {
    silt_dem_body body[2] = {
        {.n_sphere = 5,
         .sphere = plus,
         .mass = 0.05,
         .inertia = 4e-6,
         .x = {0.01, 0.12},
         .omega = {0, 0, 1},
         .angle = 0.3},
        {.n_sphere = 5, .sphere = plus, .mass = 1, .inertia = 1, .x = {-0.06, 0.03}, .angle = 0.2, .fixed = true}};
    for (int k = 0; k < 2; k++)
        OK(silt_dem_add_body(dem, &body[k], &error));
    for (int i = 0; i < 10; i++) {
        silt_dem_sphere g = grain((*id)++, -0.09 + 0.0195 * i, 0);
        g.kind = DEM_FROZEN;
        silt_dem_add(dem, 1, &g);
    }
    for (int i = 0; i < 24; i++) {
        silt_dem_sphere g = grain((*id)++, -0.07 + 0.0195 * (i % 8), 0.06 + 0.021 * (i / 8) + (i % 8 > 3) * 0.1);
        g.radius = 0.0095;
        silt_dem_add(dem, 1, &g);
    }
}

static const silt_dem_state *some_steps(silt_dem *dem, int chunks) {
    const silt_dem_state *s = silt_dem_state_now(dem);
    for (int k = 0; k < chunks; k++) {
        double *force = calloc(3 * (size_t)s->n_grain + 1, sizeof *force), push[6] = {1e-3, 1e-3, 0, 0, 0, 0},
               turn[6] = {0, 0, 1e-6, 0, 0, 0};
        for (int i = 0; i < s->n_grain; i++)
            force[3 * i] = -1e-2 * s->mass[i] * s->v[3 * i];
        s = advance(dem, 20, force, push, turn);
        free(force);
    }
    return s;
}

static void test_checkpoint(void **unused) {
    (void)unused;
    const double walls[3][4] = {{-0.1, 0.3, -0.1, -0.02}, {-1, -0.02, 1, -0.02}, {0.1, -0.02, 0.12, 0.3}};
    const char *path = "test_dem_checkpoint.h5";
    silt_dem_def def = plain();
    silt_dem *dem = NULL, *twin = NULL;
    silt_store *store = NULL;
    def.gravity[1] = -9.81;
    def.rolling_friction = 0.1;
    def.body_friction = 0.2;
    def.restitution = 0.4;
    def.n_wall = 3;
    def.wall = walls;
    OK(silt_dem_open(&dem, &def, &error));
    int64_t id = 0;
    crowd(dem, &id);
    // saved before the first run, with everything still in the queue
    OK(silt_store_create(&store, path, &error));
    OK(silt_dem_save(dem, store, &error));
    OK(silt_store_commit(&store, &error));
    OK(silt_store_open(&store, path, &error));
    OK(silt_dem_load(&twin, &def, store, &error));
    silt_store_close(&store);
    const silt_dem_state *s = some_steps(dem, 10), *t = some_steps(twin, 10);
    assert_true(fingerprint(s) == fingerprint(t));
    silt_dem_close(&twin);

    for (int k = 0; k < 50; k++)
        s = advance(dem, 700, NULL, NULL, NULL);
    int touching = 0;
    for (int i = 0; i < s->n_grain; i++)
        touching += s->contacts[i];
    for (int again = 0; again < 2; again++) {
        // some edits in the history, some waiting
        silt_dem_remove(dem, 1, &s->id[3]);
        silt_dem_sphere g = grain(id++, 0.05, 0.4 + 0.05 * again);
        silt_dem_add(dem, 1, &g);
        s = some_steps(dem, 1);
        silt_dem_remove(dem, 1, &s->id[5]);
        g = grain(id++, 0.0, 0.4 + 0.05 * again);
        silt_dem_add(dem, 1, &g);
        OK(silt_store_create(&store, path, &error));
        OK(silt_dem_save(dem, store, &error));
        OK(silt_store_commit(&store, &error));
        OK(silt_store_open(&store, path, &error));
        OK(silt_dem_load(&twin, &def, store, &error));
        silt_store_close(&store);
        assert_true(fingerprint(s) == fingerprint(silt_dem_state_now(twin)));
        for (int k = 0; k < 10; k++) {
            s = some_steps(dem, 1);
            t = some_steps(twin, 1);
            if (fingerprint(s) != fingerprint(t))
                fail_msg("after %d substeps the loaded worker differs", 20 * (k + 1));
        }
        // both go on with the same edits
        for (int side = 0; side < 2; side++) {
            silt_dem *d = side ? twin : dem;
            silt_dem_remove(d, 1, &silt_dem_state_now(d)->id[1]);
            g = grain(id, -0.05, 0.4 + 0.05 * again);
            silt_dem_add(d, 1, &g);
            some_steps(d, 20);
        }
        id++;
        s = silt_dem_state_now(dem);
        assert_true(fingerprint(s) == fingerprint(silt_dem_state_now(twin)));
        silt_dem_close(&twin);
    }
    print_message("checkpoint: %d grains, %d contacts, same bits after 200 substeps and after later edits\n",
                  s->n_grain, touching);
    assert_true(touching > 20);

    // nothing left but the bodies
    silt_dem_remove(dem, s->n_grain, s->id);
    s = advance(dem, 20, NULL, NULL, NULL);
    assert_int_equal(s->n_grain, 0);
    OK(silt_store_create(&store, path, &error));
    OK(silt_dem_save(dem, store, &error));
    OK(silt_store_commit(&store, &error));
    OK(silt_store_open(&store, path, &error));
    OK(silt_dem_load(&twin, &def, store, &error));
    silt_store_close(&store);
    assert_true(fingerprint(some_steps(dem, 10)) == fingerprint(some_steps(twin, 10)));
    silt_dem_close(&twin);
    silt_dem_close(&dem);
    unlink(path);
}

// Runs that go on from each other without a set-up: as one run, to the bit; loads that change arrive whole
static void test_keep(void **unused) {
    (void)unused;
    const double walls[3][4] = {{-0.1, 0.3, -0.1, -0.02}, {-1, -0.02, 1, -0.02}, {0.1, -0.02, 0.12, 0.3}};
    silt_dem_def def = plain();
    uint64_t print[2];
    int touching = 0;
    def.gravity[1] = -9.81;
    def.restitution = 0.4;
    def.rolling_friction = 0.1;
    def.n_wall = 3;
    def.wall = walls;
    for (int cut = 0; cut < 2; cut++) {
        silt_dem *dem = NULL;
        OK(silt_dem_open(&dem, &def, &error));
        for (int i = 0; i < 24; i++) {
            silt_dem_sphere g = grain(i, -0.07 + 0.0195 * (i % 8), 0.01 + 0.021 * (i / 8) + (i % 8 > 3) * 0.1);
            g.radius = 0.0095;
            silt_dem_add(dem, 1, &g);
        }
        const silt_dem_state *s = advance(dem, 30000, NULL, NULL, NULL);
        for (int k = 0; k < (cut ? 40 : 1); k++) {
            if (k > 0)
                silt_dem_keep(dem);
            s = advance(dem, cut ? 20 : 800, NULL, NULL, NULL);
        }
        print[cut] = fingerprint(s);
        for (int i = 0; i < s->n_grain; i++)
            touching += s->contacts[i];
        silt_dem_close(&dem);
    }
    print_message("runs that go on: %d contacts\n", touching / 2);
    assert_true(touching > 40);
    assert_true(print[0] == print[1]);

    // a grain of its own: momentum is the sum of force and time, the place that of a parabola a run
    def.gravity[1] = 0;
    silt_dem *dem = NULL;
    OK(silt_dem_open(&dem, &def, &error));
    silt_dem_sphere g = grain(1, 0.3, 0.5);
    silt_dem_add(dem, 1, &g);
    double x = 0.3, v = 0;
    for (int k = 0; k < 30; k++) {
        const double force[3] = {1e-2 * sin(3 * k), 0, 0}, t = 20 * def.step;
        if (k > 0)
            silt_dem_keep(dem);
        else
            advance(dem, 0, NULL, NULL, NULL);
        const silt_dem_state *s = advance(dem, 20, force, NULL, NULL);
        x += v * t + 0.5 * force[0] / mass * t * t;
        v += force[0] / mass * t;
        near(s->v[0], v, 1e-14, "velocity under a load that changes");
        near(s->x[0], x, 1e-14, "place under a load that changes");
    }
    silt_dem_close(&dem);
}

// no sphere at all, but a past
static void test_empty_checkpoint(void **unused) {
    (void)unused;
    const char *path = "test_dem_empty.h5";
    silt_dem_def def = plain();
    silt_dem *dem = NULL, *twin = NULL;
    silt_store *store = NULL;
    OK(silt_dem_open(&dem, &def, &error));
    silt_dem_sphere g = grain(4, 0, 0);
    silt_dem_add(dem, 1, &g);
    advance(dem, 5, NULL, NULL, NULL);
    silt_dem_remove(dem, 1, &g.id);
    advance(dem, 5, NULL, NULL, NULL);
    OK(silt_store_create(&store, path, &error));
    OK(silt_dem_save(dem, store, &error));
    OK(silt_store_commit(&store, &error));
    OK(silt_store_open(&store, path, &error));
    OK(silt_dem_load(&twin, &def, store, &error));
    silt_store_close(&store);
    g.id = 5;
    silt_dem_add(twin, 1, &g);
    assert_int_equal(advance(twin, 5, NULL, NULL, NULL)->id[0], 5);
    silt_dem_close(&twin);
    silt_dem_close(&dem);
    unlink(path);
}

static void test_failures(void **unused) {
    (void)unused;
    silt_dem_def def = plain();
    silt_dem *dem = NULL;
    // no worker
    def.worker = "/nowhere/silt-dem";
    FAILS(silt_dem_open(&dem, &def, &error),
          "cannot start the LIGGGHTS worker \"/nowhere/silt-dem\": No such file or directory");
    assert_null(dem);
    def = plain();
    def.log = "/nowhere/dem.log";
    FAILS(silt_dem_open(&dem, &def, &error), "/nowhere/dem.log: cannot write");
    def = plain();
    def.period = 0.05;
    FAILS(silt_dem_open(&dem, &def, &error), "at least 3 diameters");
    def = plain();
    def.restitution = 0.01;
    FAILS(silt_dem_open(&dem, &def, &error), "the restitution is 0.01");
    // LIGGGHTS refuses
    def = plain();
    def.poissons_ratio = 0.7;
    OK(silt_dem_open(&dem, &def, &error));
    OK(silt_dem_start(dem, 1, NULL, NULL, NULL, &error));
    FAILS(silt_dem_wait(dem, &error), "gave up: LIGGGHTS: 0 <= poissonsRatio <= 0.5 required");
    silt_dem_close(&dem);

    // killed between two runs and in the middle of one
    def = plain();
    for (int busy = 0; busy < 2; busy++) {
        OK(silt_dem_open(&dem, &def, &error));
        silt_dem_sphere g = grain(1, 0, 0);
        silt_dem_add(dem, 1, &g);
        advance(dem, 1, NULL, NULL, NULL);
        char text[256];
        snprintf(text, sizeof text, "the LIGGGHTS worker (pid %d) was killed by signal 9; its last log line: ready",
                 silt_dem_process(dem));
        if (busy)
            OK(silt_dem_start(dem, 2000000000, NULL, NULL, NULL, &error));
        kill(silt_dem_process(dem), SIGKILL);
        if (busy) {
            FAILS(silt_dem_wait(dem, &error), text);
        } else {
            siginfo_t gone;
            assert_int_equal(waitid(P_PID, (id_t)silt_dem_process(dem), &gone, WEXITED | WNOWAIT), 0);
            FAILS(silt_dem_start(dem, 1, NULL, NULL, NULL, &error), text);
        }
        FAILS(silt_dem_start(dem, 1, NULL, NULL, NULL, &error), text);
        silt_dem_close(&dem);
    }
    // closed in the middle of a run; signals of the terminal are not for the worker
    OK(silt_dem_open(&dem, &def, &error));
    OK(silt_dem_start(dem, 2000000000, NULL, NULL, NULL, &error));
    kill(silt_dem_process(dem), SIGINT);
    kill(silt_dem_process(dem), SIGTERM);
    usleep(50000);
    assert_int_equal(kill(silt_dem_process(dem), 0), 0);
    silt_dem_close(&dem); // returns at all: that run would take years

    // what is not finite never reaches LIGGGHTS
    OK(silt_dem_open(&dem, &def, &error));
    silt_dem_sphere g = grain(42, 0.25, 0.5);
    silt_dem_add(dem, 1, &g);
    advance(dem, 0, NULL, NULL, NULL);
    const double force[3] = {0, NAN, 0};
    FAILS(silt_dem_start(dem, 1, force, NULL, NULL, &error),
          "the force on grain 42 at (0.25, 0.5) is not finite: (0, nan)");
    // and the worker is none the worse
    assert_int_equal(advance(dem, 1, NULL, NULL, NULL)->n_grain, 1);
    g = grain(43, 5, 0);
    silt_dem_add(dem, 1, &g);
    FAILS(silt_dem_start(dem, 1, NULL, NULL, NULL, &error),
          "sphere 43 at (5, 0) lies outside the box (-1, -1) to (1, 1)");
    silt_dem_remove(dem, 1, &g.id);
    // one that blows up
    const double huge[3] = {1e308, 0, 0};
    OK(silt_dem_start(dem, 100, huge, NULL, NULL, &error));
    error = (silt_error){0};
    if (silt_dem_wait(dem, &error) == SILT_OK)
        assert_int_equal(silt_dem_state_now(dem)->n_grain, 0);
    else
        print_message("%s\n", error.text);
    silt_dem_close(&dem);
}

// true when the process is gone or a zombie that waits for its new parent
static bool gone_or_zombie(int pid) {
    char path[64], state = 'Z';
    snprintf(path, sizeof path, "/proc/%d/stat", pid);
    FILE *file = fopen(path, "r");
    if (!file)
        return true;
    if (fscanf(file, "%*d (%*[^)]) %c", &state) != 1)
        state = 'Z';
    fclose(file);
    return state == 'Z';
}

// silt is killed: the worker goes too, idle or not
static void test_orphan(void **unused) {
    (void)unused;
    for (int busy = 0; busy < 2; busy++) {
        int pipes[2], worker = 0;
        assert_int_equal(pipe(pipes), 0);
        pid_t parent = fork();
        if (parent == 0) {
            silt_dem_def def = plain();
            silt_dem *dem = NULL;
            if (silt_dem_open(&dem, &def, &error) == SILT_OK) {
                worker = silt_dem_process(dem);
                if (busy)
                    silt_dem_start(dem, 2000000000, NULL, NULL, NULL, &error);
            }
            usleep(20000);
            if (write(pipes[1], &worker, sizeof worker) < 0)
                _exit(1);
            raise(SIGKILL);
        }
        assert_int_equal(read(pipes[0], &worker, sizeof worker), sizeof worker);
        close(pipes[0]);
        close(pipes[1]);
        waitpid(parent, NULL, 0);
        assert_true(worker > 0);
        double start = silt_seconds();
        while (!gone_or_zombie(worker) && silt_seconds() - start < 1)
            usleep(1000);
        assert_true(gone_or_zombie(worker));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_edits),
        cmocka_unit_test(test_deposit),
        cmocka_unit_test(test_checkpoint),
        cmocka_unit_test(test_empty_checkpoint),
        cmocka_unit_test(test_keep),
        cmocka_unit_test(test_failures),
        cmocka_unit_test(test_orphan),
    };
    return cmocka_run_group_tests_name("dem_state", tests, NULL, NULL);
}
