// the command line: silt COMMAND ...; prints what the library reports and turns its status into the exit code

#include "bench.h"
#include "study.h"

#include <argp.h>
#include <errno.h>
#include <sys/stat.h>
#include <unistd.h>

const char *argp_program_version = "silt " SILT_VERSION;

/** everything that any command takes */
typedef struct main_arguments {
    const struct main_command *command;
    const char *path; // SCENE, OUT or KEY
    int n_set, set_capacity;
    const char **set; // owned, -D
    silt_run_def run;
    int steps, warm_up; // of bench
    const char *sizes;
    silt_draw_def draw;
    silt_study_def study;
} main_arguments;

typedef struct main_command {
    const char *name, *argument; // argument: its name; in brackets when it may be absent
    const char *document;
    const char *options; // the keys of main_options that it takes
    silt_status (*run)(const main_arguments *arguments, silt_error *err);
} main_command;

// ---------------------------------------------------------------- options

enum { OPTION_UNTIL = 'u', OPTION_THREADS = 't', OPTION_FORCE = 'f', OPTION_FRAME = 'n', OPTION_FIELD = 'c', OPTION_SLICE = 'l',
       OPTION_SIZES = 's', OPTION_STEPS = 'p', OPTION_WARM_UP = 'm', OPTION_PLAN = 'a', OPTION_COLLECT = 'g', OPTION_JOB = 'r',
       OPTION_WITHOUT = 'x', OPTION_FILM = 'i' };
#define LONG_ONLY(key) ((key) + 256)

static const struct argp_option main_options[] = {
    {"output", 'o', "OUT", 0, "output folder; default: the scene's folder name plus .out in the current folder (bench: JSON file, default: none; report: the page, default: OUT/report.html; study: its results, default: its name plus .study)", 0},
    {NULL, 'D', "KEY=VALUE", 0, "set a key of the scene, for example fluid.size=0.01 or bodies.temple.density=700", 0},
    {"until", LONG_ONLY(OPTION_UNTIL), "T", 0, "run to this time in s instead of the scene's time.end", 0},
    {"threads", LONG_ONLY(OPTION_THREADS), "N", 0, "threads; default: all, or OMP_NUM_THREADS; the results are the same bits (bench: one; with more, every other step is done on one)", 0},
    {"quiet", 'q', NULL, 0, "no progress line", 0},
    {"force", LONG_ONLY(OPTION_FORCE), NULL, 0, "replace an output folder that is there", 0},
    {"worker", LONG_ONLY('w'), "PATH", OPTION_HIDDEN, "the silt-dem program", 0},
    {"frame", LONG_ONLY(OPTION_FRAME), "N|all", 0, "the frame to draw; default: the last", 0},
    {"field", LONG_ONLY(OPTION_FIELD), "NAME", 0, "speed (default), pressure, elevation, vorticity, porosity, eddies, mesh or bed", 0},
    {"slice", LONG_ONLY(OPTION_SLICE), "PLANE", 0, "a cut through three dimensions, for example y=0.5", 0},
    {"without", LONG_ONLY(OPTION_WITHOUT), "PARTS", 0, "leave out water, bed, grains, bodies or walls; several with commas between", 0},
    {"film", LONG_ONLY(OPTION_FILM), "FILE", 0, "all frames as a moving picture: FILE.mp4, .webm, .webp or .gif (made by ffmpeg)", 0},
    {"sizes", LONG_ONLY(OPTION_SIZES), "LIST", 0, "nodes, for example 10k,40k; of a collapse N, for example 20,40", 0},
    {"steps", LONG_ONLY(OPTION_STEPS), "N", 0, "steps that are measured; default: 9", 0},
    {"warm-up", LONG_ONLY(OPTION_WARM_UP), "N", 0, "steps before those; default: 6", 0},
    {"jobs", 'j', "N", 0, "runs at the same time; default: 1", 0},
    {"plan", LONG_ONLY(OPTION_PLAN), NULL, 0, "print a command a line, for GNU parallel or an array of Slurm, and run nothing", 0},
    {"run", LONG_ONLY(OPTION_JOB), "N", 0, "do point N of the study alone, as the lines of --plan do", 0},
    {"collect", LONG_ONLY(OPTION_COLLECT), NULL, 0, "gather what has been run into study.csv, plots and study.md", 0},
    {"to", LONG_ONLY('d'), "FOLDER", 0, "where the pictures go; default: OUT", 0},
};
enum { N_OPTION = sizeof main_options / sizeof main_options[0] };

static double main_number(struct argp_state *state, const char *option, const char *text, bool whole) {
    char *end;
    errno = 0;
    double value = strtod(text, &end);
    if (end == text || *end || errno || !isfinite(value) || value <= 0 ||
        (whole && (value != floor(value) || value > 1e6)))
        argp_error(state, "%s %s: a positive %s is needed", option, text, whole ? "whole number" : "number");
    return value;
}

static error_t main_option(int key, char *text, struct argp_state *state) {
    main_arguments *a = state->input;
    char *end;
    switch (key) {
    case 'o':
        a->run.out = text;
        return 0;
    case 'D':
        if (!strchr(text, '=') || *text == '=')
            argp_error(state, "-D %s: KEY=VALUE is needed", text);
        SILT_RESERVE(a->set, a->set_capacity, a->n_set + 1);
        a->set[a->n_set++] = text;
        return 0;
    case 'q':
        a->run.quiet = true;
        return 0;
    case LONG_ONLY(OPTION_UNTIL):
        a->run.until = main_number(state, "--until", text, false);
        return 0;
    case LONG_ONLY(OPTION_THREADS):
        a->run.threads = (int)main_number(state, "--threads", text, true);
        return 0;
    case LONG_ONLY(OPTION_FORCE):
        a->run.force = true;
        return 0;
    case LONG_ONLY('w'):
        a->run.worker = text;
        return 0;
    case LONG_ONLY(OPTION_FRAME):
        a->draw.frames = strcmp(text, "all") == 0 ? DRAW_ALL : DRAW_ONE;
        a->draw.frame = a->draw.frames == DRAW_ONE ? (int)strtol(text, &end, 10) : 0;
        if (a->draw.frames == DRAW_ONE && (a->draw.frame < 0 || end == text || *end))
            argp_error(state, "--frame %s: a frame's number or all is needed", text);
        return 0;
    case LONG_ONLY(OPTION_FIELD):
        a->draw.field = text;
        return 0;
    case LONG_ONLY(OPTION_SLICE):
        a->draw.slice = text;
        return 0;
    case LONG_ONLY(OPTION_SIZES):
        a->sizes = text;
        return 0;
    case LONG_ONLY(OPTION_STEPS):
        a->steps = (int)main_number(state, "--steps", text, true);
        return 0;
    case LONG_ONLY(OPTION_WARM_UP):
        a->warm_up = (int)main_number(state, "--warm-up", text, true);
        return 0;
    case LONG_ONLY(OPTION_WITHOUT):
        a->draw.without = text;
        return 0;
    case LONG_ONLY(OPTION_FILM):
        a->draw.film = text;
        return 0;
    case LONG_ONLY('d'):
        a->draw.to = text;
        return 0;
    case 'j':
        a->study.jobs = (int)main_number(state, "-j", text, true);
        return 0;
    case LONG_ONLY(OPTION_PLAN):
        a->study.plan = true;
        return 0;
    case LONG_ONLY(OPTION_COLLECT):
        a->study.collect = true;
        return 0;
    case LONG_ONLY(OPTION_JOB):
        a->study.only = (int)main_number(state, "--run", text, true);
        return 0;
    case ARGP_KEY_ARG:
        if (a->path)
            argp_error(state, "one argument too many: %s", text);
        a->path = text;
        return 0;
    case ARGP_KEY_END:
        if (!a->path && *a->command->argument != '[')
            argp_error(state, "%s is missing", a->command->argument);
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

// ---------------------------------------------------------------- commands

static silt_status main_check(const main_arguments *a, silt_error *err) {
    silt_scene *scene = NULL;
    SILT_TRY(silt_scene_read(a->path, a->n_set, a->set, &scene, err));
    silt_scene_warn(scene, stderr);
    printf("%s: ok\n", a->path);
    silt_scene_free(&scene);
    return SILT_OK;
}

static silt_status main_run(const main_arguments *a, silt_error *err) {
    silt_scene *scene = NULL;
    SILT_TRY(silt_scene_read(a->path, a->n_set, a->set, &scene, err));
    silt_scene_warn(scene, stderr);
    silt_status status = silt_scene_run(scene, &a->run, err);
    silt_scene_free(&scene);
    return status;
}

// the folder of a run that the command works on
static silt_status main_out(const main_arguments *a, silt_error *err) {
    struct stat file;
    if (stat(a->path, &file) != 0)
        return silt_fail(err, SILT_INPUT, "%s: cannot be read (%s)", a->path, strerror(errno));
    if (!S_ISDIR(file.st_mode))
        return silt_fail(err, SILT_INPUT, "%s: is a file, %s takes the output folder of a run", a->path,
                         a->command->name);
    return SILT_OK;
}

static silt_status main_resume(const main_arguments *a, silt_error *err) {
    SILT_TRY(main_out(a, err));
    silt_run_def run = a->run;
    run.out = a->path;
    return silt_run_resume(&run, err);
}

static silt_status main_verify(const main_arguments *a, silt_error *err) {
    SILT_TRY(main_out(a, err));
    return silt_verify(a->path, stdout, err);
}

static silt_status main_draw(const main_arguments *a, silt_error *err) {
    SILT_TRY(main_out(a, err));
    if (a->draw.to && mkdir(a->draw.to, 0777) != 0 && errno != EEXIST)
        return silt_fail(err, SILT_FAILED, "%s: cannot be made (%s)", a->draw.to, strerror(errno));
    const silt_pictures *pictures;
    SILT_TRY(silt_pictures_load(&pictures, err));
    return pictures->draw(a->path, &a->draw, stdout, err);
}

static silt_status main_report(const main_arguments *a, silt_error *err) {
    SILT_TRY(main_out(a, err));
    const silt_report_def def = {.path = a->run.out, .draw = a->draw};
    const silt_pictures *pictures;
    SILT_TRY(silt_pictures_load(&pictures, err));
    return pictures->report(a->path, &def, stdout, err);
}

static silt_status main_info(const main_arguments *a, silt_error *err) {
    SILT_TRY(silt_info(a->path, stdout, err));
    struct stat file;
    if (stat(a->path, &file) != 0 || S_ISDIR(file.st_mode))
        return SILT_OK;
    silt_scene *scene = NULL;
    SILT_TRY(silt_scene_read(a->path, 0, NULL, &scene, err));
    const silt_status status = scene->n_body ? silt_coupling_dem.describe(scene, stdout, err) : SILT_OK;
    silt_scene_free(&scene);
    return status;
}

static silt_status main_bench(const main_arguments *a, silt_error *err) {
    const silt_bench_def def = {.scenes = a->path, .sizes = a->sizes, .steps = a->steps, .warm_up = a->warm_up,
                                .threads = a->run.threads, .n_set = a->n_set, .set = a->set, .json = a->run.out,
                                .worker = a->run.worker, .quiet = a->run.quiet};
    return silt_bench(&def, stdout, err);
}

static silt_status main_study(const main_arguments *a, silt_error *err) {
    silt_study_def def = a->study;
    def.path = a->path;
    def.out = a->run.out;
    def.force = a->run.force;
    def.quiet = a->run.quiet;
    def.worker = a->run.worker;
    def.n_set = a->n_set;
    def.set = a->set;
    return silt_study(&def, stdout, err);
}

static silt_status main_help(const main_arguments *a, silt_error *err);

static const main_command main_commands[] = {
    {"check", "SCENE", "Reads a scene and reports all its errors at once, without running it.", "D", main_check},
    {"run", "SCENE", "Runs a scene from its start.", "oDutqfw", main_run},
    {"resume", "OUT", "Goes on from the newest whole checkpoint in OUT; with --until also a finished run.", "utqw",
     main_resume},
    {"verify", "OUT", "Holds the results in OUT against the checks of the scene, a line per check.", "", main_verify},
    {"draw", "OUT", "Draws frames of a run as PNG pictures, or all of them as a film.", "ncdlxi", main_draw},
    {"report", "OUT", "Makes one HTML page of a run: pictures, a view to turn, checks, ledgers, times.", "oclx", main_report},
    {"info", "OUT|SCENE", "Tells what a scene asks for, or what stands in an output folder.", "", main_info},
    {"bench", "[SCENES]", "Measures what steps cost, phase by phase, in scenes of its own or in files (commas between).", "oDtqwspm",
     main_bench},
    {"study", "STUDY", "Runs a scene over ranges of its keys: errors, times, what becomes of it at extremes; finished runs are kept.",
     "oDjagrqfw", main_study},
    {"help", "[KEY|COMMAND]", "Explains the keys of a scene: all of them, a block, or one, for example fluid.size; or a command.",
     "", main_help},
};
enum { N_COMMAND = sizeof main_commands / sizeof main_commands[0] };

static void main_usage(FILE *to) {
    fprintf(to, "silt %s: water, bed, grains and rigid objects by particle finite elements and discrete elements\n\n",
            SILT_VERSION);
    for (int i = 0; i < N_COMMAND; i++)
        fprintf(to, "  silt %-7s %-13s %s\n", main_commands[i].name, main_commands[i].argument,
                main_commands[i].document);
    fprintf(to, "\nsilt COMMAND --help lists a command's options, silt --version tells the version.\n"
                "Exit code: 0 done, 1 the run or a check failed, 2 wrong usage or scene, 3 stopped by a signal with a "
                "checkpoint written.\n");
}

// the options that a command takes
static struct argp main_argp(const main_command *command, struct argp_option option[N_OPTION + 1], char name[32]) {
    int n = 0;
    for (int i = 0; i < N_OPTION; i++)
        if (strchr(command->options, main_options[i].key & 255))
            option[n++] = main_options[i];
    snprintf(name, 32, "silt %s", command->name);
    return (struct argp){option, main_option, command->argument, command->document, NULL, NULL, NULL};
}

// what `silt COMMAND --help` prints; for bench its scenes too
static void main_explain(const main_command *command) {
    struct argp_option option[N_OPTION + 1] = {0};
    char name[32];
    struct argp argp = main_argp(command, option, name);
    argp_help(&argp, stdout, ARGP_HELP_STD_HELP & ~(unsigned)ARGP_HELP_EXIT_OK, name);
    int n = 0;
    const bench_scene *list = command->run == main_bench ? bench_scene_list(&n) : NULL;
    for (int k = 0; k < n; k++)
        printf("%s  %-12s %s (%s)\n", k ? "" : "\nScenes and their sizes:\n", list[k].name, list[k].document, list[k].sizes);
    if (n)
        puts("\ndocs/performance.md explains the table.");
    if (command->run == main_study) {
        puts("\nKeys of a study (silt help study.KEY tells more, docs/study.md all):\n");
        silt_study_help(NULL, stdout, NULL);
    }
}

static silt_status main_help(const main_arguments *a, silt_error *err) {
    for (int i = 0; i < N_COMMAND && a->path; i++)
        if (strcmp(a->path, main_commands[i].name) == 0) {
            main_explain(&main_commands[i]);
            return SILT_OK;
        }
    if (a->path && strncmp(a->path, "study.", 6) == 0)
        return silt_study_help(a->path + 6, stdout, err);
    return silt_scene_help(a->path, stdout, err);
}

// reads the command's arguments with the options that it takes; a wrong one ends the program with code 2
static void main_parse(main_arguments *a, int argc, char **argv) {
    struct argp_option option[N_OPTION + 1] = {0};
    char name[32];
    struct argp argp = main_argp(a->command, option, name);
    argv[0] = name;
    argp_err_exit_status = SILT_INPUT;
    argp_parse(&argp, argc, argv, 0, NULL, a);
}

// Threads of OpenMP that wait for others spin for 15 ms: on a busy machine, where others may not run for as long, a step of 12.7k nodes
// in space took 20 times its time on one thread. 0.1 ms is enough to bridge what is not done in parallel between two loops. The
// runtime reads its settings before main, so the program begins once more with them set.
static void main_calm(char **argv) {
    if (getenv("OMP_WAIT_POLICY") || getenv("GOMP_SPINCOUNT"))
        return;
    setenv("GOMP_SPINCOUNT", "2000", 1);
    execv("/proc/self/exe", argv); // where that cannot be, it goes on as it is
}

int main(int argc, char **argv) {
    silt_memory_settle();
    main_arguments a = {0};
    silt_error err = {0};
    const char *word = argc > 1 ? argv[1] : "";
    if (strcmp(word, "--version") == 0 || strcmp(word, "-V") == 0) {
        puts(argp_program_version);
        return SILT_OK;
    }
    if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0 || strcmp(word, "-?") == 0) {
        main_usage(stdout);
        return SILT_OK;
    }
    for (int i = 0; i < N_COMMAND; i++)
        if (strcmp(word, main_commands[i].name) == 0)
            a.command = &main_commands[i];
    if (!a.command) {
        if (*word)
            fprintf(stderr, "silt: %s is no command\n\n", word);
        main_usage(stderr);
        return SILT_INPUT;
    }
    main_calm(argv);
    main_parse(&a, argc - 1, argv + 1);
    silt_status status = a.command->run(&a, &err);
    // stdout first: the reason stands below what was printed
    bool lost = fflush(stdout) != 0;
    if (status)
        fprintf(stderr, "%s%s", err.text, *err.text && err.text[strlen(err.text) - 1] == '\n' ? "" : "\n");
    else if (lost)
        fprintf(stderr, "silt: standard output cannot be written (%s)\n", strerror(errno));
    free(a.set);
    return status ? (int)status : lost;
}
