// summary.json: what became of a run, and the progress line while it goes

#include "output.h"
#include "parallel.h"

#include <errno.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <time.h>
#include <unistd.h>

static const char *const summary_phase[PHASE_COUNT] = {
#define X(name) #name,
    SILT_PHASES(X)
#undef X
};

// ---------------------------------------------------------------- JSON

void silt_json_text(FILE *to, const char *text) {
    if (!text) {
        fputs("null", to);
        return;
    }
    fputc('"', to);
    for (; *text; text++) {
        if (*text == '"' || *text == '\\')
            fprintf(to, "\\%c", *text);
        else if (*text == '\n')
            fputs("\\n", to);
        else if ((unsigned char)*text < 32)
            fprintf(to, "\\u%04x", (unsigned)*text);
        else
            fputc(*text, to);
    }
    fputc('"', to);
}

// JSON knows no NaN and no infinity
void silt_json_number(FILE *to, const char *name, double value, const char *end) {
    if (isfinite(value))
        fprintf(to, "\"%s\": %.9g%s", name, value, end);
    else
        fprintf(to, "\"%s\": null%s", name, end);
}

static void summary_checks(FILE *to, const silt_scene *scene, const silt_check_result *check) {
    fputs("  \"checks\": [", to);
    for (int i = 0; i < scene->n_check; i++) {
        fprintf(to, "%s\n    {\"name\": ", i ? "," : "");
        silt_json_text(to, check[i].name);
        fputs(", ", to);
        silt_json_number(to, "value", check[i].value, ", ");
        silt_json_number(to, "reference", check[i].reference, ", ");
        silt_json_number(to, "error", check[i].error, ", ");
        silt_json_number(to, "tolerance", check[i].tolerance, ", ");
        fprintf(to, "\"pass\": %s, \"note\": ", check[i].pass ? "true" : "false");
        silt_json_text(to, check[i].note);
        fputc('}', to);
    }
    fputs(scene->n_check ? "\n  ]\n" : "]\n", to);
}

// the processor's name as the system tells it; empty where it does not. Owned by the caller
static char *summary_processor(void) {
    FILE *from = fopen("/proc/cpuinfo", "r");
    char *line = NULL, *name = NULL;
    size_t capacity = 0;
    while (from && !name && getline(&line, &capacity, from) > 0)
        if (strncmp(line, "model name", 10) == 0 && strchr(line, ':')) {
            const char *text = strchr(line, ':') + 1;
            text += strspn(text, " \t");
            name = silt_text("%.*s", (int)strcspn(text, "\n"), text);
        }
    if (from)
        fclose(from);
    free(line);
    return name ? name : silt_text("%s", "");
}

// on what this process ran, and when it wrote this
static void summary_machine(FILE *to) {
    char *processor = summary_processor(), ended[32];
    const time_t now = time(NULL);
    struct utsname system;
    struct tm utc;
    fputs("  \"machine\": {\"processor\": ", to);
    silt_json_text(to, processor);
    fprintf(to, ", \"processors\": %ld, \"threads\": %d, \"system\": ", sysconf(_SC_NPROCESSORS_ONLN), silt_threads_asked());
    char *name = uname(&system) == 0 ? silt_text("%s %s %s", system.sysname, system.release, system.machine) : silt_text("%s", "");
    silt_json_text(to, name);
    strftime(ended, sizeof ended, "%Y-%m-%d %H:%M UTC", gmtime_r(&now, &utc));
    fprintf(to, "},\n  \"ended\": \"%s\",\n", ended);
    free(name);
    free(processor);
}

// what the ledgers were off by at worst, and which of the scene's bounds that is beyond
static void summary_bounds(FILE *to, const silt_scene *scene, const silt_bounds *bounds) {
    const char *comma = "";
    if (!bounds->rows)
        return;
    fputs("  \"bounds\": {", to);
    for (silt_bound_kind k = 0; k < BOUND_COUNT; k++)
        silt_json_number(to, silt_bound_word[k], bounds->of[k].worst, ", ");
    fputs("\"beyond\": [", to);
    for (silt_bound_kind k = 0; k < BOUND_COUNT; k++) {
        char text[256];
        double allowed;
        if (!silt_bounds_broken(bounds, scene, k, &allowed, text))
            continue;
        fprintf(to, "%s\"%s\"", comma, silt_bound_word[k]);
        comma = ", ";
    }
    fputs("]},\n", to);
}

static void summary_print(FILE *to, const silt_view *view, const silt_summary *summary,
                          const silt_check_result *check) {
    const silt_scene *scene = view->scene;
    struct rusage usage = {0};
    getrusage(RUSAGE_SELF, &usage);
    double per_node = summary->node_steps > 0 ? 1e6 / summary->node_steps : 0;

    fputs("{\n  \"version\": ", to);
    silt_json_text(to, SILT_VERSION);
    fputs(",\n  \"title\": ", to);
    silt_json_text(to, scene->title);
    fprintf(to, ",\n  \"scene_hash\": \"%016llx\",\n  \"status\": ", (unsigned long long)scene->hash);
    silt_json_text(to, summary->status);
    fputs(",\n  \"message\": ", to);
    silt_json_text(to, summary->message ? summary->message : "");
    fprintf(to, ",\n  \"steps\": %lld,\n  ", (long long)view->step);
    silt_json_number(to, "time", view->time, ",\n  ");
    silt_json_number(to, "time_end", scene->time.end, ",\n  ");
    fprintf(to, "\"nodes\": %d,\n  ", view->nodes ? view->nodes->count : 0);
    fprintf(to, "\"grains\": %d,\n  ", view->grains ? view->grains->count : 0);

    // cost of this process' part of the run
    fprintf(to, "\"steps_here\": %lld,\n  ", (long long)summary->steps);
    fprintf(to, "\"retries\": %lld,\n  ", (long long)summary->retries);
    fprintf(to, "\"iterations\": %lld,\n  ", (long long)summary->iterations);
    fprintf(to, "\"most_iterations\": %lld,\n  ", (long long)summary->most_iterations);
    if (scene->n_body)
        fprintf(to, "\"clipped\": %lld,\n  ", (long long)summary->clipped);
    silt_json_number(to, "seconds", summary->seconds, ",\n  ");
    silt_json_number(to, "node_steps", summary->node_steps, ",\n  ");
    silt_json_number(to, "microseconds_per_node_step", summary->seconds * per_node, ",\n  ");
    fputs("\"phases\": {", to);
    for (int i = 0; i < PHASE_COUNT; i++) {
        fprintf(to, "%s\n    \"%s\": {", i ? "," : "", summary_phase[i]);
        silt_json_number(to, "seconds", summary->phase[i], ", ");
        silt_json_number(to, "microseconds_per_node_step", summary->phase[i] * per_node, "}");
    }
    fprintf(to, "\n  },\n  \"peak_memory_bytes\": %lld,\n  ", 1024LL * usage.ru_maxrss);
    silt_json_number(to, "worst_volume_error", summary->worst_volume_error, ",\n  ");
    silt_json_number(to, "worst_sediment_error", summary->worst_sediment_error, ",\n  ");
    silt_json_number(to, "worst_momentum_error", summary->worst_momentum_error, ",\n");
    summary_bounds(to, scene, &summary->bounds);
    fputs("  \"bodies\": [", to);
    for (int i = 0; view->bodies && i < view->bodies->count; i++) {
        const struct silt_body *b = &view->bodies->body[i];
        fprintf(to, "%s\n    {\"name\": ", i ? "," : "");
        silt_json_text(to, scene->body[i].name);
        fputs(", ", to);
        silt_json_number(to, "volume", b->volume, ", ");
        silt_json_number(to, "mass", b->mass, ", ");
        fprintf(to, "\"spheres\": %d, ", b->n_sphere);
        silt_json_number(to, "clump_error", b->clump_error, "}");
    }
    fprintf(to, "%s],\n", view->bodies && view->bodies->count ? "\n  " : "");
    summary_machine(to);
    summary_checks(to, scene, check);
    fputs("}\n", to);
}

silt_status silt_summary_write(const char *out, const silt_view *view, const silt_summary *summary, silt_error *err) {
    char *path = silt_text("%s/summary.json", out), *aside = silt_text("%s.part", path);
    silt_check_result *check = silt_alloc((size_t)view->scene->n_check + 1, sizeof *check);
    silt_status status = SILT_OK;
    // without a history the checks fail with a note, the summary is written all the same
    silt_check_measure(view->scene, out, check, NULL);
    FILE *to = fopen(aside, "w");
    if (to)
        summary_print(to, view, summary, check);
    if (!to || fflush(to) != 0 || ferror(to) || rename(aside, path) != 0) {
        status = silt_fail(err, SILT_FAILED, "%s: cannot be written (%s)", path, strerror(errno));
        unlink(aside);
    }
    if (to)
        fclose(to);
    free(check);
    free(aside);
    free(path);
    return status;
}

// ---------------------------------------------------------------- progress

// a terminal line is rewritten this often, s; a log gets a line per tenth of the run
#define PROGRESS_PERIOD 0.2

// "1:23:45" or "2:05"
static void progress_clock(double seconds, char text[32]) {
    if (!isfinite(seconds) || seconds > 3.6e9) {
        snprintf(text, 32, "?");
        return;
    }
    long s = lround(seconds);
    if (s >= 3600)
        snprintf(text, 32, "%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
    else
        snprintf(text, 32, "%ld:%02ld", s / 60, s % 60);
}

void silt_progress(const silt_view *view, double until, double seconds, bool last) {
    // the one line on the terminal belongs to the process: where it began, when it was written, how fast steps are
    static double began = NAN, written = -HUGE_VAL, speed;
    static int tenth = -1;
    int n = view->nodes ? view->nodes->count : 0;
    double wall = 0;
    for (int i = 0; i < PHASE_COUNT; i++)
        wall += view->wall[i];
    if (isnan(began) || seconds < written)
        began = view->time - view->dt;
    double now = n > 0 ? 1e6 * wall / n : 0;
    speed = speed > 0 ? 0.98 * speed + 0.02 * now : now;

    bool terminal = isatty(STDERR_FILENO);
    int part = until > 0 ? (int)(10 * view->time / until + 1e-9) : 0;
    if (!last && (terminal ? seconds - written < PROGRESS_PERIOD && seconds >= written : part == tenth))
        return;
    written = seconds;
    tenth = part;

    char left[32];
    progress_clock(last ? seconds : seconds * (until - view->time) / (view->time - began), left);
    fprintf(stderr, "%st %.5g of %.5g s  step %lld  dt %.3g", terminal ? "\r\033[K" : "", view->time, until,
            (long long)view->step, view->dt);
    if (view->nodes)
        fprintf(stderr, "  nodes %d", n);
    if (view->grains && view->scene->grains.on)
        fprintf(stderr, "  grains %d", view->grains->count);
    if (view->nodes && view->ledger)
        fprintf(stderr, "  volume %+.2e  %.3g us/node", view->ledger->volume_error, speed);
    fprintf(stderr, last ? "  took %s" : "  left %s", left);
    if (!terminal || last)
        fputc('\n', stderr);
    fflush(stderr);
}
