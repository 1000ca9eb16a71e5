// the life of a run: begun or taken up again, stepped to its end, checkpoints on the way, closed
#include <signal.h>
#include <unistd.h>

#include "parallel.h"
#include "run.h"

static volatile sig_atomic_t run_asked, run_stop; // a signal asked for a checkpoint; SIGTERM came

static void on_signal(int number) {
    run_asked = 1;
    if (number == SIGTERM)
        run_stop = 1;
}

silt_status silt_run_checkpoint(silt_run *run, silt_error *err) {
    if (run->saved_step == run->step)
        return SILT_OK;
    // the history must reach the disk first: a checkpoint is never ahead of it
    silt_status status = run->again ? SILT_OK : silt_history_sync(run->history, err);
    char *path = silt_text("%s/checkpoint-%c.h5", run->out, 'a' + run->checkpoint_slot);
    if (status == SILT_OK)
        status = silt_run_save(run, path, err);
    free(path);
    run->whole = status == SILT_OK;
    run->back = status == SILT_OK ? run->back : -1;
    if (status == SILT_OK) {
        run->checkpoint_slot = 1 - run->checkpoint_slot;
        run->saved_step = run->step;
        run->saved_time = run->time;
    }
    return status;
}

static silt_status run_begin(silt_run *run, const silt_scene *scene, const silt_run_def *def, const char *out, int lock,
                             silt_error *err) {
    *run = (silt_run){.scene = scene, .def = *def, .saved_step = -1, .back = -1, .back_set_up = -1, .lock = lock,
                       .n_shown = -1};
    run->out = silt_text("%s", out);
    run->log = silt_text("%s/dem.log", out);
    run->trace = silt_text("%s/trace.csv", out);
    run->worker = silt_worker_find(def->worker);
    run->started = silt_seconds();
    silt_clock_reset();
    run->summary.status = "running";
    silt_threads_ask(def->threads);
    run->nodes.dim = run->mesh.dim = scene->dimension;
    run->mesh.period[0] = scene->period[1] - scene->period[0];
    run->gauge = silt_alloc((size_t)silt_gauges_count(scene) + 1, sizeof *run->gauge);
    run->wall_force = silt_alloc((size_t)scene->n_wall + 1, sizeof *run->wall_force);
    SILT_TRY(silt_walls_create(&run->walls, scene, err));
    silt_run_box(run);
    return SILT_OK;
}

// the state at t = 0
static silt_status run_from_start(silt_run *run, silt_error *err) {
    silt_view view;
    SILT_TRY(silt_run_first(run, err));
    SILT_TRY(silt_run_measure(run, err));
    silt_run_view(run, &view);
    return silt_gauges_create(&run->gauges, &view, err);
}

// the state of a checkpoint
static silt_status run_from_checkpoint(silt_run *run, const char *path, silt_error *err) {
    silt_store *store = NULL;
    silt_status status = silt_store_open(&store, path, err);
    if (status == SILT_OK)
        status = silt_run_load(run, store, err);
    if (status == SILT_OK)
        silt_walls_move(&run->walls, run->scene, run->time, 0);
    silt_store_close(&store);
    return status;
}

static bool run_late(const silt_run *run) {
    return run->scene->time.wall > 0 && silt_seconds() - run->started > run->scene->time.wall;
}

// A step that fails after grains, bodies or bed have gone on has changed the state before it. Steps have the same bits whenever they are
// made: those since the last checkpoint are made once more, up to the last good state, which is saved.
static silt_status run_go_back(silt_run *run, silt_error *err) {
    silt_run *again = silt_alloc(1, sizeof *again);
    char *old = silt_text("%s/checkpoint-%c.h5", run->out, 'b' - run->checkpoint_slot);
    silt_status status = run_begin(again, run->scene, &run->def, run->out, -1, err);
    again->again = true;
    again->checkpoint_slot = run->checkpoint_slot;
    free(again->log);
    again->log = silt_text("/dev/null");
    free(again->trace);
    again->trace = NULL;
    if (status == SILT_OK && run->saved_step >= 0)
        status = run_from_checkpoint(again, old, err);
    else if (status == SILT_OK) {
        status = run_from_start(again, err);
        if (status == SILT_OK)
            status = silt_run_output(again, err);
    }
    free(old);
    if (status == SILT_OK && !run->def.quiet)
        fprintf(stderr, "\nstep %lld failed after it had changed its start: steps %lld to %lld are made again to save that\n", (long long)run->step + 1,
                (long long)again->step + 1, (long long)run->back);
    while (status == SILT_OK && again->step < run->back)
        status = run_stop || run_late(run) ? silt_fail(err, SILT_STOPPED, "there is no time left") : silt_run_advance(again, err);
    if (status == SILT_OK)
        status = silt_history_sync(run->history, err);
    if (status == SILT_OK)
        status = silt_run_checkpoint(again, err);
    if (status == SILT_OK) {
        run->saved_step = again->step;
        run->saved_time = again->time;
    }
    silt_run_free(again);
    free(again);
    return status;
}

// a run that fails tells where it can be taken up again; when only the next step failed, that is where it stands
static void run_failed(silt_run *run, silt_error *err) {
    silt_error late = {0};
    if (run->whole)
        silt_run_checkpoint(run, &late);
    else if (run->back > run->saved_step)
        run_go_back(run, &late);
    if (!err)
        return;
    if (late.count)
        snprintf(err->text + strlen(err->text), sizeof err->text - strlen(err->text), "\nno checkpoint of this state: %s", late.text);
    if (run->saved_step >= 0)
        snprintf(err->text + strlen(err->text), sizeof err->text - strlen(err->text),
                 "\nthe last checkpoint is of step %lld, t = %.9g s; go on from it with: silt resume %s", (long long)run->saved_step, run->saved_time,
                 run->out);
}

static double run_end(const silt_run *run) { return run->def.until > 0 ? run->def.until : run->scene->time.end; }

bool silt_run_ended(const silt_run *run) {
    const int64_t most = run->scene->time.steps;
    return run->time >= run_end(run) * (1 - 1e-12) || (most > 0 && run->step >= most);
}

// what a signal or the wall's clock asks for, and the checkpoints that the scene asks for
static silt_status run_keep(silt_run *run, int64_t frames_between, silt_error *err) {
    const bool late = run_late(run);
    if ((run_asked || late) && silt_run_set_up_due(run, run->dt) && !silt_run_ended(run)) {
        run_asked = 0;
        SILT_TRY(silt_run_checkpoint(run, err));
        if (run_stop || late)
            return silt_fail(err, SILT_STOPPED, "stopped %s at t = %.9g s; a checkpoint is written, go on with: silt resume %s",
                             run_stop ? "by a signal" : "since time.wall is over", run->time, run->out);
    } else if (run->tick == 0 && run->offset == 0 && run->frame % frames_between == 0)
        SILT_TRY(silt_run_checkpoint(run, err));
    return SILT_OK;
}

static silt_status run_loop(silt_run *run, silt_error *err) {
    const silt_scene *scene = run->scene;
    const double every = scene->time.checkpoint > 0 ? scene->time.checkpoint : 10 * scene->time.output;
    const int64_t frames_between = (int64_t)silt_max(1, floor(every / scene->time.output + 0.5));
    silt_view view;
    while (!silt_run_ended(run)) {
        SILT_TRY(silt_run_advance(run, err));
        SILT_TRY(run_keep(run, frames_between, err));
        silt_run_view(run, &view);
        if (!run->def.quiet)
            silt_progress(&view, run_end(run), silt_seconds() - run->started, false);
    }
    // the end of a run is a place to go on from too
    return silt_run_checkpoint(run, err);
}

// a run that went to its end and whose ledgers are beyond the scene's bounds says so
static void run_judge(silt_run *run, bool whole) {
    silt_bounds *bounds = &run->summary.bounds;
    if (!silt_bounds_measure(run->scene, run->out, bounds) || !whole)
        return;
    for (silt_bound_kind k = 0; k < BOUND_COUNT; k++) {
        char text[256];
        double allowed;
        if (silt_bounds_broken(bounds, run->scene, k, &allowed, text))
            silt_run_warn(run, "beyond its bounds: %s", text);
    }
}

// summary and history are closed whatever happened; the first error is the one that is told
silt_status silt_run_finish(silt_run **owned, silt_status status, silt_error *err) {
    silt_run *run = *owned;
    silt_view view;
    if (status == SILT_FAILED)
        run_failed(run, err);
    run->summary.status = status == SILT_OK ? "done" : status == SILT_STOPPED ? "stopped" : "failed";
    run->summary.message = status == SILT_OK || !err ? NULL : err->text;
    run->summary.seconds = silt_seconds() - run->started;
    silt_run_view(run, &view);
    if (!run->def.quiet && run->history)
        silt_progress(&view, run_end(run), run->summary.seconds, true);
    silt_error late = {0};
    silt_status closed = silt_history_close(&run->history, &late);
    run_judge(run, status == SILT_OK);
    if (closed == SILT_OK)
        closed = silt_summary_write(run->out, &view, &run->summary, &late);
    if (status == SILT_OK && closed != SILT_OK) {
        status = closed;
        if (err)
            *err = late;
    }
    silt_scene_free(&run->scene_own);
    silt_run_free(run);
    free(run);
    *owned = NULL;
    return status;
}

static void signals_catch(void) {
    struct sigaction action = {.sa_handler = on_signal, .sa_flags = SA_RESTART};
    sigemptyset(&action.sa_mask);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGUSR1, &action, NULL);
    run_asked = run_stop = 0;
}

// the state at t = 0 with its row and frame
static silt_status run_start(silt_run *run, silt_error *err) {
    SILT_TRY(silt_verify_copy(run->scene, run->out, err));
    SILT_TRY(run_from_start(run, err));
    SILT_TRY(silt_history_create(&run->history, run->out, run->scene, err));
    return silt_run_output(run, err);
}

silt_status silt_run_open(silt_run *run, const silt_scene *scene, const silt_run_def *def, const char *out, int lock,
                          silt_error *err) {
    SILT_TRY(run_begin(run, scene, def, out, lock, err));
    return run_start(run, err);
}

silt_status silt_run_start(silt_run **run, const silt_scene *scene, const silt_run_def *def, silt_error *err) {
    int lock = -1;
    char *out = def->out ? silt_text("%s", def->out) : silt_folder_default(scene);
    *run = NULL;
    silt_status status = silt_folder_prepare(out, def->force, &lock, err);
    if (status == SILT_OK) {
        *run = silt_alloc(1, sizeof **run);
        status = silt_run_open(*run, scene, def, out, lock, err);
        if (status != SILT_OK)
            status = silt_run_finish(run, status, err);
    }
    free(out);
    return status;
}

silt_status silt_scene_run(const silt_scene *scene, const silt_run_def *def, silt_error *err) {
    silt_run *run;
    signals_catch();
    SILT_TRY(silt_run_start(&run, scene, def, err));
    return silt_run_finish(&run, run_loop(run, err), err);
}

// the step of one of the two checkpoints, -1 when it cannot be read
static int64_t checkpoint_step(const char *path, silt_error *err) {
    silt_store *store = NULL;
    int64_t step = -1;
    if (silt_store_open(&store, path, err) != SILT_OK || silt_store_take(store, "run/step", STORE_LONG, 1, &step, err) != SILT_OK)
        step = -1;
    silt_store_close(&store);
    return step;
}

// a line in the log: where the run went on, and what was wrong with a checkpoint that was passed over
static void resume_log(const silt_run *run, const char *path, const char *other, const char *why) {
    char *log = silt_text("%s/run.log", run->out);
    FILE *to = fopen(log, "a");
    if (to) {
        fprintf(to, "resumed at step %lld, time %.9g from %s", (long long)run->step, run->time, strrchr(path, '/') + 1);
        fprintf(to, *why && access(other, F_OK) == 0 ? "; passed over: %s\n" : "\n", why);
        fclose(to);
    }
    free(log);
}

// the newest of the two checkpoints that can be read whole
static silt_status resume_load(silt_run *run, const silt_scene *scene, const silt_run_def *def, int lock, silt_error *err) {
    char *path[2];
    int64_t step[2];
    silt_error why[2] = {{0}};
    silt_status status = SILT_FAILED;
    for (int k = 0; k < 2; k++) {
        path[k] = silt_text("%s/checkpoint-%c.h5", def->out, 'a' + k);
        step[k] = checkpoint_step(path[k], &why[k]);
    }
    for (int turn = 0; turn < 2 && status != SILT_OK; turn++) {
        const int k = step[1] > step[0];
        if (step[k] < 0)
            break;
        status = run_begin(run, scene, def, def->out, -1, &why[k]);
        if (status == SILT_OK)
            status = run_from_checkpoint(run, path[k], &why[k]);
        if (status != SILT_OK) {
            silt_run_free(run);
            step[k] = -1;
            continue;
        }
        run->checkpoint_slot = 1 - k;
        run->saved_step = run->step;
        run->saved_time = run->time;
        run->whole = true;
        run->back = run->back_set_up = run->step;
        run->lock = lock;
        resume_log(run, path[k], path[1 - k], why[1 - k].text);
    }
    if (status != SILT_OK)
        silt_fail(err, SILT_FAILED, "%s: no checkpoint to go on from: %s; %s", def->out, why[0].text, why[1].text);
    free(path[0]);
    free(path[1]);
    return status;
}

silt_status silt_run_take_up(silt_run **run, const silt_run_def *def, silt_error *err) {
    char *path = silt_text("%s/scene.yaml", def->out);
    silt_scene *scene = NULL;
    int lock = -1;
    *run = NULL;
    silt_status status = silt_scene_read(path, 0, NULL, &scene, err);
    free(path);
    SILT_TRY(status);
    silt_run *r = silt_alloc(1, sizeof *r);
    status = silt_folder_lock(def->out, &lock, err);
    if (status == SILT_OK) {
        status = resume_load(r, scene, def, lock, err);
        if (status != SILT_OK && lock >= 0)
            close(lock);
    }
    if (status == SILT_OK) {
        r->scene_own = scene;
        status = silt_frame_cut(r->out, (int)r->frame, err);
        if (status == SILT_OK)
            status = silt_history_reopen(&r->history, r->out, scene, r->step, err);
        if (status == SILT_OK) {
            *run = r;
            return SILT_OK;
        }
        silt_run_free(r); // what the folder says of the run before stays
    }
    free(r);
    silt_scene_free(&scene);
    return status;
}

silt_status silt_run_resume(const silt_run_def *def, silt_error *err) {
    silt_run *run;
    signals_catch();
    SILT_TRY(silt_run_take_up(&run, def, err));
    return silt_run_finish(&run, run_loop(run, err), err);
}

// ---------------------------------------------------------------- looked at from outside

void silt_run_fields(silt_run *run, silt_fields *fields) {
    silt_view view;
    silt_run_view(run, &view);
    *fields = (silt_fields){.dim = run->scene->dimension, .step = run->step, .time = run->time, .dt = run->dt, .n_body = run->scene->n_body};
    if (view.nodes) {
        fields->n_node = view.nodes->count;
        fields->x = view.nodes->x;
        fields->v = view.nodes->v;
        fields->p = view.nodes->p;
        fields->n_cell = view.mesh->n_cell;
        fields->cell = (const int(*)[4])view.mesh->cell;
    }
    if (view.grains) {
        fields->n_grain = view.grains->count;
        fields->grain_id = view.grains->id;
        fields->grain_x = view.grains->x;
        fields->grain_v = view.grains->v;
        fields->grain_radius = view.grains->radius;
    }
}

bool silt_run_body(silt_run *run, const char *name, silt_pose *pose) {
    silt_view view;
    silt_run_view(run, &view);
    for (int i = 0; view.bodies && i < view.bodies->count; i++) {
        const struct silt_body *b = &view.bodies->body[i];
        if (strcmp(run->scene->body[i].name, name) != 0)
            continue;
        *pose = (silt_pose){.x = {b->x[0], b->x[1], b->x[2]}, .v = {b->v[0], b->v[1], b->v[2]},
                            .q = {b->q[0], b->q[1], b->q[2], b->q[3]}, .w = {b->w[0], b->w[1], b->w[2]}};
        return true;
    }
    return false;
}

double silt_run_value(silt_run *run, const char *column) {
    silt_view view;
    silt_run_view(run, &view);
    return silt_history_value(run->history, &view, run->gauge, column);
}
