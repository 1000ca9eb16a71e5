// the run from inside: what a scene without bed does not have, and a step that fails leaves everything as it was

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "run_folder.h"

#include <unistd.h>

#include <sys/stat.h>

// a scene of the tree, with what is set in it, at its start in a folder of its own
static void begin(silt_run *run, silt_scene **scene, const char *path, int n_set, const char *const *set) {
    char full[1024];
    snprintf(full, sizeof full, "%s/%s", SILT_SOURCE, path);
    OK(silt_scene_read(full, n_set, set, scene, &error));
    folder_begin(run, *scene);
}

static void steps(silt_run *run, int n) {
    silt_error err = {0};
    for (int k = 0; k < n; k++)
        if (silt_run_advance(run, &err) != SILT_OK)
            fail_msg("step %d: %s", k, err.text);
}

// ---------------------------------------------------------------- water alone

static void test_water_alone(void **state) {
    (void)state;
    silt_run run;
    silt_scene *scene;
    begin(&run, &scene, "cases/dam-break/scene.yaml", 1, (const char *const[]){"fluid.size=0.006"});
    steps(&run, 20);

    // no array of bed, grains or bodies was ever made
    assert_true(zero(&run.bed, sizeof run.bed));
    assert_null(run.coupling);
    assert_null(run.drag);
    assert_null(run.barrier.bed);
    assert_null(run.barrier.bodies);
    assert_null(run.waiting);
    assert_null(run.rest);
    assert_null(run.freed);
    assert_null(run.grown);
    assert_null(run.body_before);
    silt_view view;
    silt_run_view(&run, &view);
    assert_null(view.bed);
    assert_null(view.grains);
    assert_null(view.bodies);
    assert_true(view.wall[PHASE_bed] == 0 && view.wall[PHASE_dem] == 0);

    // nor a column or a file
    char path[600], header[8192];
    snprintf(path, sizeof path, "%s/history.csv", folder);
    FILE *from = fopen(path, "r");
    assert_non_null(from);
    assert_non_null(fgets(header, sizeof header, from));
    fclose(from);
    header[strcspn(header, "\n")] = 0;
    for (char *name = strtok(header, ","); name; name = strtok(NULL, ",")) {
        const bool wall = strncmp(name, "wall_", 5) == 0; // the clock has a column per phase in every scene
        if (!wall &&
            (strstr(name, "bed") || strstr(name, "grain") || strstr(name, "sediment") || strstr(name, "released") ||
             strstr(name, "deposited") || strstr(name, "pore") || strstr(name, "left")))
            fail_msg("a scene of water alone has the column %s", name);
    }
    DIR *list = opendir(folder);
    assert_non_null(list);
    for (struct dirent *entry; (entry = readdir(list));)
        if (strncmp(entry->d_name, "bed", 3) == 0 || strncmp(entry->d_name, "grains", 6) == 0 ||
            strncmp(entry->d_name, "bodies", 6) == 0 || strcmp(entry->d_name, "dem.log") == 0)
            fail_msg("a scene of water alone has the file %s", entry->d_name);
    closedir(list);
    end(&run, &scene);
}

// ---------------------------------------------------------------- a step that fails

/** bits of everything that a step changes */
typedef struct bits {
    uint64_t water, mesh, clocks, ledger, sediment, bed, grains, bodies;
} bits;

static bits take_bits(const silt_run *run) {
    bits b = {0};
    const silt_nodes *nodes = &run->nodes;
    const size_t n = (size_t)nodes->count;
    b.water = silt_hash(0, nodes->x, 2 * n * sizeof(double));
    b.water = silt_hash(b.water, nodes->v, 2 * n * sizeof(double));
    b.water = silt_hash(b.water, nodes->p, n * sizeof(double));
    b.water = silt_hash(b.water, nodes->debt, n * sizeof(double));
    b.water = silt_hash(b.water, nodes->id, n * sizeof *nodes->id);
    b.water = silt_hash(b.water, nodes->kind, n);
    b.water = silt_hash(b.water, nodes->wall, n * sizeof *nodes->wall);
    b.mesh = silt_hash(0, run->mesh.cell, (size_t)run->mesh.n_cell * sizeof *run->mesh.cell);
    b.mesh = silt_hash(b.mesh, &run->mesh.revision, sizeof run->mesh.revision);
    const double clock[] = {run->time, run->offset, run->dt, (double)run->step, (double)run->frame, (double)run->tick};
    b.clocks = silt_hash(0, clock, sizeof clock);
    b.ledger = silt_hash(0, &run->ledger, sizeof run->ledger);
    b.sediment = silt_hash(0, run->waiting, (size_t)run->n_waiting * sizeof *run->waiting);
    b.sediment = silt_hash(b.sediment, run->rest, (size_t)run->n_rest * sizeof *run->rest);
    const silt_bed *bed = &run->bed;
    if (bed->n_node) {
        b.bed = silt_hash(0, bed->work, (size_t)bed->n_node * sizeof(double));
        b.bed = silt_hash(b.bed, bed->eroded, (size_t)bed->n_node * sizeof(double));
        b.bed = silt_hash(b.bed, bed->cell, (size_t)bed->n_cell * sizeof *bed->cell);
        b.bed = silt_hash(b.bed, bed->mass, (size_t)bed->n_cell * sizeof(double));
    }
    if (run->coupling) {
        const silt_grain_state *grains = silt_coupling_dem.grains(run->coupling);
        b.grains = silt_hash(0, grains->x, 3 * (size_t)grains->count * sizeof(double));
        b.grains = silt_hash(b.grains, grains->v, 3 * (size_t)grains->count * sizeof(double));
        b.grains = silt_hash(b.grains, grains->omega, 3 * (size_t)grains->count * sizeof(double));
        const silt_body_state *bodies = silt_coupling_dem.bodies(run->coupling);
        for (int k = 0; k < bodies->count; k++)
            b.bodies = silt_hash(b.bodies, &bodies->body[k], offsetof(struct silt_body, n_point));
    }
    return b;
}

// thrown: what fails is not the water's step but the force on a body, which would throw it out of the scene
static void fails_and_leaves(const char *path, int n_set, const char *const *set, int before, int after, bool thrown) {
    silt_run run;
    silt_scene *scene;
    silt_error err = {0};
    begin(&run, &scene, path, n_set, set);
    steps(&run, before);
    const double dt = run.dt;
    const double tolerance = scene->fluid.tolerance, carry = thrown ? run.body_carry[0][0] : 0;
    const int iterations = scene->fluid.iterations;
    if (thrown)
        run.body_carry[0][0] = 1e9; // N s, that the water owes it
    else {
        // nothing can converge to this
        scene->fluid.tolerance = 1e-30;
        scene->fluid.iterations = 1;
    }
    const bits whole = take_bits(&run);
    for (int k = 0; k < 2; k++) {
        err = (silt_error){0};
        assert_int_equal(silt_run_advance(&run, &err), SILT_FAILED);
        assert_true(run.whole);
        assert_non_null(strstr(err.text, "gave up after"));
        assert_non_null(strstr(err.text, thrown ? "would throw body '" : "continuity did not converge: a node at ("));
        const bits left = take_bits(&run);
        assert_true(left.water == whole.water);
        assert_true(left.mesh == whole.mesh);
        assert_true(left.clocks == whole.clocks);
        assert_true(left.ledger == whole.ledger);
        assert_true(left.sediment == whole.sediment);
        assert_true(left.bed == whole.bed);
        assert_true(left.grains == whole.grains);
        assert_true(left.bodies == whole.bodies);
        assert_true(run.dt == dt);
    }

    // and the same run goes on as if nothing had been
    scene->fluid.tolerance = tolerance;
    scene->fluid.iterations = iterations;
    if (thrown)
        run.body_carry[0][0] = carry;
    steps(&run, after);
    const bits mended = take_bits(&run);
    end(&run, &scene);
    begin(&run, &scene, path, n_set, set);
    steps(&run, before + after);
    const bits straight = take_bits(&run);
    assert_true(memcmp(&mended, &straight, sizeof mended) == 0);
    end(&run, &scene);
}

// ---------------------------------------------------------------- drops

// it falls from the lid, along the wall beside it
static void test_drop_under_lid(void **state) {
    (void)state;
    silt_run run;
    silt_scene *scene;
    const char *set[] = {"time.step=0.01"};
    begin(&run, &scene, "tests/scenes/lid.yaml", 1, set);
    double highest = 0, now = 0;
    for (int k = 0; k < 30; k++) {
        steps(&run, 1);
        now = 0;
        for (int i = 0; i < run.nodes.count; i++)
            if (!run.mesh.wet[i] && run.nodes.kind[i] == NODE_FLUID)
                now = silt_max(now, run.nodes.x[3 * i + 2]);
        highest = silt_max(highest, now);
    }
    // half a second times g from the lid that it met at 0.03 s
    assert_true(highest > 0.95 && highest < 1 + 1e-9);
    assert_true(now > 0.6 && now < 0.7);
    end(&run, &scene);
}

// ---------------------------------------------------------------- the step's length

// a bar of water in flight, with cells of 0.1 m: half a cell a step of what counts
static void test_pace(void **state) {
    (void)state;
    silt_run run;
    silt_scene *scene;
    const char *set[] = {"fluid.regions.0.box=[[-1, -0.1, -0.1], [1, 0.1, 0.1]]", "fluid.jitter=0"};
    begin(&run, &scene, "tests/scenes/space-thrown.yaml", 2, set);
    double *v = run.nodes.v, square = 0;
    int tip = 0;
    for (int i = 0; i < run.nodes.count; i++) {
        v[3 * i] = 1000;
        v[3 * i + 1] = v[3 * i + 2] = 0;
        tip = run.nodes.x[3 * i] > run.nodes.x[3 * tip] ? i : tip;
    }
    assert_float_equal(silt_run_pace(&run), 0.05 / 1000, 1e-12); // all as fast: none is spray
    // a fast node among slow ones pulls its cells apart; as a drop in flight it may cross two cells
    for (int i = 0; i < run.nodes.count; i++)
        v[3 * i] = i == tip ? 1000 : 10;
    assert_float_equal(silt_run_pace(&run), 0.05 / 1000, 1e-12);
    run.mesh.wet[tip] = 0;
    assert_float_equal(silt_run_pace(&run), 0.05 / 250, 1e-12);
    run.mesh.wet[tip] = 1;
    // spray that parts slowly: three times the largest difference between neighbours, at the tip
    double next = 0;
    for (int i = 0; i < run.nodes.count; i++) {
        v[3 * i] = 1000 * pow(0.5 * (1 + run.nodes.x[3 * i]), 6);
        square += silt_square(v[3 * i]) / run.nodes.count;
        next = run.nodes.x[3 * i] < 0.92 ? silt_max(next, v[3 * i]) : next; // layers are half a cell apart, edges a cell long
    }
    const double apart = 1000 - next;
    assert_true(2 * sqrt(square) < 3 * apart && 3 * apart < 1000);
    assert_float_equal(silt_run_pace(&run), 0.05 / (3 * apart), 1e-12);
    end(&run, &scene);
}

static void test_failed_step_water(void **state) {
    (void)state;
    fails_and_leaves("cases/dam-break/scene.yaml", 1, (const char *const[]){"fluid.size=0.006"}, 30, 10, false);
}

// water, bed, grains and a body, when grains are in the water
static void test_failed_step_coupled(void **state) {
    (void)state;
    fails_and_leaves("tests/scenes/hill.yaml", 1, (const char *const[]){"bed.work=0.005"}, 58, 6, false);
}

// the body rides on moving water, whose inlet changes: prescribed velocities too are put back
static void test_failed_step_prescribed(void **state) {
    (void)state;
    fails_and_leaves("tests/scenes/drum.yaml", 0, NULL, 12, 6, false);
}

// a force that would throw the body is not given to LIGGGHTS, which would lose it
static void test_failed_step_thrown(void **state) {
    (void)state;
    fails_and_leaves("tests/scenes/drum.yaml", 0, NULL, 12, 6, true);
}

// ---------------------------------------------------------------- release

// of spheres of rising x: the deepest overlap, of the smaller radius
typedef struct ball {
    double x[3], radius;
} ball;

static int ball_order(const void *a, const void *b) {
    const ball *p = a, *q = b;
    return (p->x[0] > q->x[0]) - (p->x[0] < q->x[0]);
}

static double overlap_most(int n, ball *list) {
    double most = 0, largest = 0;
    qsort(list, (size_t)n, sizeof *list, ball_order);
    for (int i = 0; i < n; i++)
        largest = silt_max(largest, list[i].radius);
    for (int i = 0; i < n; i++)
        for (int j = i + 1; j < n && list[j].x[0] - list[i].x[0] < 2 * largest; j++) {
            const double apart = hypot(hypot(list[i].x[0] - list[j].x[0], list[i].x[1] - list[j].x[1]), list[i].x[2] - list[j].x[2]);
            most = silt_max(most, (list[i].radius + list[j].radius - apart) / silt_min(list[i].radius, list[j].radius));
        }
    return most;
}

// A bed of 1e4 patches is due at once: all of it leaves, to the last bit, as spheres that do not touch
static void release_at_once(const char *work, const char *per_patch, const char *parcel, int least) {
    silt_run run;
    silt_scene *scene;
    begin(&run, &scene, "tests/scenes/release.yaml", 3, (const char *const[]){work, per_patch, parcel});
    const double whole = run.bed.solid_mass;
    int exposed = 0;
    for (int k = 0; k < run.bed.n_node; k++)
        if (run.bed.exposed[k]) {
            run.bed.work[k] = 2e-3;
            exposed++;
        }
    assert_in_range(exposed, 10000, 10001);
    silt_run_release(&run);
    assert_int_equal(run.bed.n_cell, 0);
    assert_int_equal(run.bed.n_edge, 0);
    assert_true(run.bed.solid_mass == 0 && fabs(run.ledger.released_mass - whole) <= 1e-15 * whole);
    assert_in_range(run.n_waiting, least, 10 * least);

    // those that found no room wait: they and the others are the bed's mass
    silt_run_place(&run);
    const silt_grain_state *grains = silt_coupling_dem.grains(run.coupling);
    double mass = 0, rest = 0;
    ball *place = silt_alloc((size_t)grains->count + 1, sizeof *place);
    for (int k = 0; k < grains->count; k++) {
        silt_sum(&mass, &rest, grains->mass[k]);
        memcpy(place[k].x, grains->x + 3 * k, sizeof place[k].x);
        place[k].radius = grains->radius[k];
        int element;
        assert_true(silt_walls_distance(&run.walls, place[k].x, &element) >= place[k].radius);
    }
    for (int k = 0; k < run.n_waiting; k++)
        silt_sum(&mass, &rest, run.waiting[k].mass);
    assert_true(fabs(mass - whole) <= 1e-14 * whole);
    assert_in_range(grains->count, 9 * least / 10, 10 * least);
    assert_true(overlap_most(grains->count, place) <= 0.01);
    free(place);
    end(&run, &scene);
}

static void test_release_at_once(void **state) {
    (void)state;
    release_at_once("bed.work=0", "grains.per_patch=1", "grains.parcel=0.006", 9800);
    release_at_once("bed.work=1.0e-3", "grains.per_patch=4", "grains.parcel=0.003", 39000);
}

// ---------------------------------------------------------------- water that is kept of a body

// What is kept of the water at one of two spheres is no longer true. Where that matters little the next step finds it anew, out of turn;
// where it would throw the sphere the step is taken again.
static void test_water_anew(void **state) {
    (void)state;
    static const struct {
        double factor;
        int retries;
    } old[] = {{0.85, 0}, {0.1, 1}};
    for (size_t k = 0; k < sizeof old / sizeof *old; k++) {
        silt_run run;
        silt_scene *scene;
        begin(&run, &scene, "tests/scenes/space-pair.yaml", 0, NULL);
        steps(&run, 2);
        const int b = run.step % 2 ? 0 : 1; // whose turn has just been
        const silt_body_water *water = &run.body_water[b];
        double *inertia = run.body_inertia + 6 * b * (12 + 1); // of its motion along x, the others after it
        const double right = *inertia;
        assert_true(water->known == 2 && right > 1);
        for (int c = 0; c < 3; c++)
            inertia[13 * c] *= old[k].factor;
        steps(&run, 1); // the other's turn
        assert_int_equal(run.summary.retries, old[k].retries);
        if (old[k].retries == 0) {
            assert_float_equal(*inertia, old[k].factor * right, 1e-12 * right);
            assert_true(water->known == 0);
            run.step++; // and the other's again
            steps(&run, 1);
        }
        assert_true(water->known == 2);
        assert_float_equal(*inertia, right, 0.05 * right);
        end(&run, &scene);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_water_alone),
        cmocka_unit_test(test_drop_under_lid), cmocka_unit_test(test_pace), cmocka_unit_test(test_failed_step_water),
        cmocka_unit_test(test_failed_step_coupled),
        cmocka_unit_test(test_failed_step_prescribed),
        cmocka_unit_test(test_failed_step_thrown),
        cmocka_unit_test(test_release_at_once),
        cmocka_unit_test(test_water_anew),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
