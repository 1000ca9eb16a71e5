#include "script.h"

#include <liggghts/library.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define COMMAND_LENGTH 2048

// the k-th prime above 10000: LIGGGHTS wants a different one for every fix that draws random numbers
static int script_prime(int k) {
    int prime = 10007;
    for (int n = 10009, found = 0; found < k; n += 2) {
        bool composite = false;
        for (int d = 3; d * d <= n && !composite; d += 2)
            composite = n % d == 0;
        if (!composite) {
            prime = n;
            found++;
        }
    }
    return prime;
}

__attribute__((format(printf, 2, 3))) static void script_say(void *lmp, const char *format, ...) {
    char line[COMMAND_LENGTH];
    va_list list;
    va_start(list, format);
    vsnprintf(line, sizeof line, format, list);
    va_end(list);
    lammps_command(lmp, line);
}

// a scratch file opened for writing from its start; closing it leaves the descriptor open
static FILE *script_file(int fd) {
    FILE *file = NULL;
    int copy = dup(fd);
    if (copy >= 0 && ftruncate(fd, 0) == 0 && lseek(fd, 0, SEEK_SET) == 0)
        file = fdopen(copy, "w");
    if (!file) {
        perror("silt-dem: scratch file");
        abort();
    }
    return file;
}

static void script_file_close(FILE *file) {
    if (fclose(file) != 0) {
        perror("silt-dem: scratch file");
        abort();
    }
}

// the contact law that spheres and walls share
static const char *script_law(const dem_shared *s) {
    return s->rolling_friction > 0 ? "model hertz tangential history rolling_friction epsd2"
                                   : "model hertz tangential history";
}

static void script_materials(void *lmp, const dem_shared *s) {
    const int n = DEM_TYPE_DEAD;
    char value[COMMAND_LENGTH], friction[COMMAND_LENGTH];

    if (fmin(s->youngs_modulus, s->wall_modulus) < 5e6)
        script_say(lmp, "soft_particles yes");
    if (fmax(s->youngs_modulus, s->wall_modulus) > 1e9)
        script_say(lmp, "hard_particles yes");
    // one value per type
    int used = 0;
    for (int i = 0; i < n; i++)
        used += snprintf(value + used, sizeof value - (size_t)used, " %.17g", i + 1 == DEM_TYPE_WALL ? s->wall_modulus : s->youngs_modulus);
    script_say(lmp, "fix m1 all property/global youngsModulus peratomtype%s", value);
    used = 0;
    for (int i = 0; i < n; i++)
        used += snprintf(value + used, sizeof value - (size_t)used, " %.17g", s->poissons_ratio);
    script_say(lmp, "fix m2 all property/global poissonsRatio peratomtype%s", value);
    // one value per pair of types
    used = 0;
    for (int i = 0; i < n * n; i++)
        used += snprintf(value + used, sizeof value - (size_t)used, " %.17g", s->restitution);
    script_say(lmp, "fix m3 all property/global coefficientRestitution peratomtypepair %d%s", n, value);
    used = 0;
    for (int i = 1; i <= n; i++)
        for (int j = 1; j <= n; j++) {
            bool body =
                i == DEM_TYPE_BODY || j == DEM_TYPE_BODY || i == DEM_TYPE_FIXED_BODY || j == DEM_TYPE_FIXED_BODY;
            used += snprintf(friction + used, sizeof friction - (size_t)used, " %.17g",
                             body ? s->body_friction : s->friction);
        }
    script_say(lmp, "fix m4 all property/global coefficientFriction peratomtypepair %d%s", n, friction);
    if (s->rolling_friction > 0) {
        used = 0;
        for (int i = 0; i < n * n; i++)
            used += snprintf(value + used, sizeof value - (size_t)used, " %.17g", s->rolling_friction);
        script_say(lmp, "fix m5 all property/global coefficientRollingFriction peratomtypepair %d%s", n, value);
    }
    script_say(lmp, "pair_style gran %s", script_law(s));
    script_say(lmp, "pair_coeff * *");
}

// Which walls are planes must not hang on where those that move are: a run that goes on from a checkpoint would give LIGGGHTS other
// walls than the run before, and contacts lose their springs. So walls that move count by all that they ever reach.
static bool script_stands(const dem_shared *s, int i) {
    return DEM_SECTION(s, const int, wall_motion)[i] < 0;
}
static bool script_passes_below(const dem_shared *s, int axis, double c) {
    return s->n_motion && s->way_lo[axis] < c;
}
static bool script_passes_above(const dem_shared *s, int axis, double c) {
    return s->n_motion && s->way_hi[axis] > c;
}

// true when another wall ends at x and goes to the side of wall i on which the others lie
static bool script_joined(const dem_shared *s, int i, const double x[2], double tolerance) {
    const double(*wall)[4] = (const double(*)[4])DEM_SECTION(s, const double, wall);
    for (int j = 0; j < s->n_wall; j++)
        for (int end = 0; j != i && script_stands(s, j) && end < 4; end += 2)
            if (fabs(wall[j][end] - x[0]) < tolerance && fabs(wall[j][end + 1] - x[1]) < tolerance)
                return true;
    return false;
}

// 0 or 1: wall i may be the infinite plane x = c or y = c: it runs along an axis, all other walls lie on one side, and
// each end either meets another wall or comes near to the box' side, so that nothing is there to tell the difference;
// else -1
static int script_plane(const dem_shared *s, int i) {
    const double(*wall)[4] = (const double(*)[4])DEM_SECTION(s, const double, wall);
    const double near_side = 0.2; // of the box
    const double *w = wall[i];
    double tolerance = 1e-9 * (s->hi[0] - s->lo[0] + s->hi[1] - s->lo[1]);
    int across = fabs(w[0] - w[2]) < tolerance ? 0 : fabs(w[1] - w[3]) < tolerance ? 1 : -1;
    if (across < 0)
        return -1;
    int along = 1 - across;
    bool below = script_passes_below(s, across, w[across] - tolerance), above = script_passes_above(s, across, w[across] + tolerance);
    for (int j = 0; j < s->n_wall; j++)
        for (int end = 0; script_stands(s, j) && end < 4; end += 2) {
            below |= wall[j][end + across] < w[across] - tolerance;
            above |= wall[j][end + across] > w[across] + tolerance;
        }
    if (below && above)
        return -1;
    double from = fmin(w[along], w[along + 2]), to = fmax(w[along], w[along + 2]),
           margin = near_side * (s->hi[along] - s->lo[along]);
    const double *first = w[along] <= w[along + 2] ? w : w + 2, *last = first == w ? w + 2 : w;
    if (from > s->lo[along] + margin && !script_joined(s, i, first, tolerance))
        return -1;
    if (to < s->hi[along] - margin && !script_joined(s, i, last, tolerance))
        return -1;
    return across;
}

// cuts the segment to the box (Liang and Barsky); false: nothing is left
static bool script_clip(const dem_shared *s, double w[4]) {
    double t0 = 0, t1 = 1, d[2] = {w[2] - w[0], w[3] - w[1]};
    for (int k = 0; k < 2; k++) {
        double inset = 1e-6 * (s->hi[k] - s->lo[k]), lo = s->lo[k] + inset, hi = s->hi[k] - inset;
        if (d[k] == 0) {
            if (w[k] < lo || w[k] > hi)
                return false;
            continue;
        }
        double a = (lo - w[k]) / d[k], b = (hi - w[k]) / d[k];
        t0 = fmax(t0, fmin(a, b));
        t1 = fmin(t1, fmax(a, b));
    }
    if (t1 - t0 < 1e-9)
        return false;
    double x = w[0], y = w[1];
    w[0] = x + t0 * d[0];
    w[1] = y + t0 * d[1];
    w[2] = x + t1 * d[0];
    w[3] = y + t1 * d[1];
    return true;
}

// the segment as a strip of triangles about z = 0, narrower than the period: no contact comes near its rims
static void script_strip(FILE *file, const dem_shared *s, const double w[4]) {
    double length = hypot(w[2] - w[0], w[3] - w[1]), z = 0.35 * s->period;
    int n = (int)ceil(length / (0.7 * s->period));
    double normal[2] = {-(w[3] - w[1]) / length, (w[2] - w[0]) / length};
    for (int i = 0; i < n; i++) {
        double a = (double)i / n, b = (double)(i + 1) / n;
        double p[2][2] = {{w[0] + a * (w[2] - w[0]), w[1] + a * (w[3] - w[1])},
                          {w[0] + b * (w[2] - w[0]), w[1] + b * (w[3] - w[1])}};
        // corners of the two triangles: end along the wall, side in z
        static const int corner[2][3][2] = {{{0, 0}, {0, 1}, {1, 1}}, {{0, 0}, {1, 1}, {1, 0}}};
        for (int t = 0; t < 2; t++) {
            fprintf(file, "facet normal %.9g %.9g 0\nouter loop\n", normal[0], normal[1]);
            for (int c = 0; c < 3; c++)
                fprintf(file, "vertex %.17g %.17g %.17g\n", p[corner[t][c][0]][0], p[corner[t][c][0]][1],
                        corner[t][c][1] ? z : -z);
            fprintf(file, "endloop\nendfacet\n");
        }
    }
}

// ---- walls in space

// 0 to 2: the triangles in that plane across this axis are the whole face of the box that all triangles span, and others close its
// rim: nothing is there to tell it from the infinite plane; else -1
static int script_face(const dem_shared *s, int i) {
    const double(*t)[10] = (const double(*)[10])DEM_SECTION(s, const double, triangle);
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY}, size = 0;
    for (int j = 0; j < s->n_triangle; j++)
        for (int c = 0; script_stands(s, s->n_wall + j) && c < 9; c++) {
            lo[c % 3] = fmin(lo[c % 3], t[j][c]);
            hi[c % 3] = fmax(hi[c % 3], t[j][c]);
        }
    for (int k = 0; k < 3; k++)
        size = fmax(size, hi[k] - lo[k]);
    const double tolerance = 1e-9 * size;
    int across = -1;
    for (int k = 0; k < 3; k++)
        if (fabs(t[i][k] - t[i][3 + k]) < tolerance && fabs(t[i][k] - t[i][6 + k]) < tolerance)
            across = k;
    if (across < 0 || (fabs(t[i][across] - lo[across]) > tolerance && fabs(t[i][across] - hi[across]) > tolerance))
        return -1;
    if (fabs(t[i][across] - lo[across]) <= tolerance ? script_passes_below(s, across, lo[across] - tolerance)
                                                     : script_passes_above(s, across, hi[across] + tolerance))
        return -1;
    const int p = (across + 1) % 3, q = (across + 2) % 3;
    double area = 0;
    for (int j = 0; j < s->n_triangle; j++) {
        bool in = script_stands(s, s->n_wall + j);
        for (int c = 0; c < 3; c++)
            in &= fabs(t[j][3 * c + across] - t[i][across]) < tolerance;
        if (!in)
            continue;
        area += fabs((t[j][3 + p] - t[j][p]) * (t[j][6 + q] - t[j][q]) - (t[j][3 + q] - t[j][q]) * (t[j][6 + p] - t[j][p])) / 2;
        // an open rim, but for that at the ends of a period
        for (int c = 0; c < 3; c++) {
            const double *a = &t[j][3 * c], *b = &t[j][3 * ((c + 1) % 3)];
            const bool border = s->periodic && fabs(a[0] - b[0]) < tolerance &&
                                (fabs(a[0] - s->lo[0]) < tolerance || fabs(a[0] - s->hi[0]) < tolerance);
            if ((int)t[j][9] >> c & 1 && !border)
                return -1;
        }
    }
    return fabs(area - (hi[p] - lo[p]) * (hi[q] - lo[q])) < 1e-9 * size * size ? across : -1;
}

// one triangle, cut at the middle of its longest side while that is longer than `longest`: neighbours are cut alike
static void script_triangle(FILE *file, double longest, const double t[9]) {
    double square = 0;
    int side = 0;
    for (int c = 0; c < 3; c++) {
        double sum = 0;
        for (int d = 0; d < 3; d++)
            sum += (t[3 * c + d] - t[3 * ((c + 1) % 3) + d]) * (t[3 * c + d] - t[3 * ((c + 1) % 3) + d]);
        if (sum > square) {
            square = sum;
            side = c;
        }
    }
    if (square > longest * longest) {
        const double *a = &t[3 * side], *b = &t[3 * ((side + 1) % 3)], *c = &t[3 * ((side + 2) % 3)];
        const double m[3] = {0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])};
        const double half[2][9] = {{a[0], a[1], a[2], m[0], m[1], m[2], c[0], c[1], c[2]}, {m[0], m[1], m[2], b[0], b[1], b[2], c[0], c[1], c[2]}};
        script_triangle(file, longest, half[0]);
        script_triangle(file, longest, half[1]);
        return;
    }
    double normal[3], length = 0;
    for (int d = 0; d < 3; d++) {
        const int e = (d + 1) % 3, f = (d + 2) % 3;
        normal[d] = (t[3 + e] - t[e]) * (t[6 + f] - t[f]) - (t[3 + f] - t[f]) * (t[6 + e] - t[e]);
        length += normal[d] * normal[d];
    }
    length = sqrt(length);
    if (!(length > 1e-12 * square)) // nothing was left of it
        return;
    fprintf(file, "facet normal %.9g %.9g %.9g\nouter loop\n", normal[0] / length, normal[1] / length, normal[2] / length);
    for (int c = 0; c < 3; c++)
        fprintf(file, "vertex %.17g %.17g %.17g\n", t[3 * c], t[3 * c + 1], t[3 * c + 2]);
    fprintf(file, "endloop\nendfacet\n");
}

// the file with the triangles of walls, opened when the first one comes
static FILE *script_open_walls(FILE **file, const char *path) {
    if (!*file && !(*file = fopen(path, "w"))) {
        perror(path);
        abort();
    }
    if (ftell(*file) == 0)
        fprintf(*file, "solid walls\n");
    return *file;
}

// the part of a triangle inside of the period, in pieces that are short for it
static void script_cut(FILE *file, const dem_shared *s, const double t[9]) {
    double point[2][8][3];
    int n = 3, now = 0;
    memcpy(point[0], t, 9 * sizeof *t);
    for (int end = 0; end < 2; end++, now = !now) {
        const double border = end ? s->hi[0] : s->lo[0], sign = end ? -1 : 1;
        int kept = 0;
        for (int k = 0; k < n; k++) {
            const double *a = point[now][k], *b = point[now][(k + 1) % n];
            const double da = sign * (a[0] - border), db = sign * (b[0] - border);
            if (da >= 0)
                memcpy(point[!now][kept++], a, sizeof point[0][0]);
            if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
                // from the lower end whichever way round: neighbours cut their common side alike
                const double *p = da < db ? a : b, *q = da < db ? b : a, share = (border - p[0]) / (q[0] - p[0]);
                for (int d = 0; d < 3; d++)
                    point[!now][kept][d] = d == 0 ? border : p[d] + share * (q[d] - p[d]);
                kept++;
            }
        }
        n = kept;
    }
    for (int k = 1; k + 1 < n; k++) {
        double piece[9];
        memcpy(piece, point[now][0], sizeof point[0][0]);
        memcpy(piece + 3, point[now][k], sizeof point[0][0]);
        memcpy(piece + 6, point[now][k + 1], sizeof point[0][0]);
        script_triangle(file, 0.4 * (s->hi[0] - s->lo[0]), piece);
    }
}

// planes of the triangles that make one, each told once. @return how many
static int script_faces(void *lmp, const dem_shared *s, int *plane) {
    const double(*t)[10] = (const double(*)[10])DEM_SECTION(s, const double, triangle);
    const int *moves = DEM_SECTION(s, const int, wall_motion) + s->n_wall;
    const double tolerance = 1e-9 * (s->hi[0] - s->lo[0]);
    int n_plane = 0, told = 0;
    for (int i = 0; i < s->n_triangle; i++) {
        const int across = moves[i] < 0 ? script_face(s, i) : -1;
        plane[i] = across >= 0;
        if (across < 0)
            continue;
        // what closes the tank at the ends of a period closes nothing
        if (((across == 0 && s->periodic) || (across == 1 && s->across)) &&
            (t[i][across] < s->lo[across] + tolerance || t[i][across] > s->hi[across] - tolerance)) {
            plane[i] = -1;
            continue;
        }
        // low and high faces of three axes
        double other = 0;
        for (int j = 0; j < s->n_triangle; j++)
            other = fabs(t[j][across] - t[i][across]) > fabs(other) ? t[j][across] - t[i][across] : other;
        const int face = 2 * across + (other < 0);
        if (told >> face & 1)
            continue;
        told |= 1 << face;
        n_plane++;
        script_say(lmp, "fix wp%d all wall/gran %s primitive type %d %cplane %.17g", face, script_law(s), DEM_TYPE_WALL, 'x' + across,
                   t[i][across]);
    }
    return n_plane;
}

// the walls' file: LIGGGHTS reads it at once
static void script_wall_path(char path[128]) {
    snprintf(path, 128, "%s/silt-dem-%d.stl", access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp", (int)getpid());
}

// All walls with this motion (-1: those that stand still and are no planes) as one surface of triangles in the file.
// @return false: there are none
static bool script_surface(const dem_shared *s, int motion, int *plane, const char *path) {
    const double(*wall)[4] = (const double(*)[4])DEM_SECTION(s, const double, wall);
    const int *moves = DEM_SECTION(s, const int, wall_motion);
    FILE *file = NULL;
    for (int i = 0; i < s->n_wall; i++) {
        double w[4];
        if (moves[i] != motion || plane[i] == 1)
            continue;
        memcpy(w, wall[i], sizeof w);
        if (!script_clip(s, w)) {
            plane[i] = -1;
            continue;
        }
        script_strip(script_open_walls(&file, path), s, w);
    }
    const double(*triangle)[10] = (const double(*)[10])DEM_SECTION(s, const double, triangle);
    for (int i = 0; i < s->n_triangle; i++) {
        if (moves[s->n_wall + i] != motion || plane[s->n_wall + i] != 0)
            continue;
        if (s->periodic)
            script_cut(script_open_walls(&file, path), s, triangle[i]);
        else
            script_triangle(script_open_walls(&file, path), INFINITY, triangle[i]);
    }
    if (file) {
        fprintf(file, "endsolid walls\n");
        script_file_close(file);
    }
    return file != NULL;
}

// Walls that move are surfaces of their own. First the way of what they turn about, then the turn: its point goes along.
// @param names  out, of the surfaces. @return how many there are
static int script_moving(void *lmp, const dem_shared *s, int *plane, FILE *names) {
    int there = 0;
    const dem_motion *motion = DEM_SECTION(s, const dem_motion, motion);
    char path[128];
    script_wall_path(path);
    script_motion(lmp, s, NULL);
    for (int m = 0; m < s->n_motion; m++) {
        if (!script_surface(s, m, plane, path))
            continue;
        script_say(lmp, "fix wm%d all mesh/surface file %s type %d", m, path, DEM_TYPE_WALL);
        unlink(path);
        script_say(lmp, "fix wv%d all move/mesh mesh wm%d linear/variable v_x%d v_y%d v_z%d", m, m, m, m, m);
        script_say(lmp, "fix wt%d all move/mesh mesh wm%d rotate/variable origin %.17g %.17g %.17g axis %s omega v_w%d", m, m,
                   motion[m].centre[0], motion[m].centre[1], motion[m].centre[2], s->dim == 3 ? "0 -1 0" : "0 0 1", m);
        there++;
        fprintf(names, " wm%d", m);
    }
    return there;
}

// LIGGGHTS knows variables by their place in its list, and puts one that is given anew at the end: all of them are, in the same order
void script_motion(void *lmp, const dem_shared *s, const double (*rate)[4]) {
    static const char name[4] = {'x', 'y', 'z', 'w'};
    for (int m = 0; m < s->n_motion; m++)
        for (int k = 0; k < 4; k++)
            script_say(lmp, "variable %c%d equal %.17g", name[k], m, rate ? rate[m][k] : 0);
}

static void script_walls(void *lmp, const dem_shared *s, int *plane) {
    const double(*wall)[4] = (const double(*)[4])DEM_SECTION(s, const double, wall);
    const int *moves = DEM_SECTION(s, const int, wall_motion);
    char path[128];
    script_wall_path(path);
    int n_plane = script_faces(lmp, s, plane + s->n_wall);
    for (int i = 0; i < s->n_wall; i++) {
        int across = moves[i] < 0 ? script_plane(s, i) : -1;
        plane[i] = across >= 0;
        if (across >= 0) {
            script_say(lmp, "fix wp%d all wall/gran %s primitive type %d %cplane %.17g", i, script_law(s),
                       DEM_TYPE_WALL, across ? 'y' : 'x', wall[i][across]);
            n_plane++;
        }
    }
    // all surfaces belong to one fix: LIGGGHTS allows no second one
    char *names = NULL;
    size_t size = 0;
    FILE *list = open_memstream(&names, &size);
    if (!list)
        abort();
    int n_surface = script_surface(s, -1, plane, path);
    if (n_surface) {
        script_say(lmp, "fix wm all mesh/surface file %s type %d", path, DEM_TYPE_WALL);
        unlink(path);
        fprintf(list, " wm");
    }
    n_surface += script_moving(lmp, s, plane, list);
    fclose(list);
    if (n_surface)
        script_say(lmp, "fix ww all wall/gran %s mesh n_meshes %d meshes%s", script_law(s), n_surface, names);
    free(names);
    // LIGGGHTS insists that type 1 is in use: a plane far away
    if (!n_surface && !n_plane)
        script_say(lmp, "fix wp all wall/gran %s primitive type %d yplane %.17g", script_law(s), DEM_TYPE_WALL,
                   s->lo[1] - 10 * (s->hi[1] - s->lo[1]) - 10 * s->max_radius);
}

// the box in z
static double script_low(const dem_shared *s) {
    return s->dim == 3 ? s->lo[2] : -s->period / 2;
}

static double script_high(const dem_shared *s) {
    return s->dim == 3 ? s->hi[2] : s->period / 2;
}

static double script_skin(const dem_shared *s) {
    return 0.3 * s->min_radius;
}

// Width of the bins in which LIGGGHTS looks for pairs: each bin costs time in every set-up, empty ones too, and wide ones hold
// many spheres that do not touch. Few spheres in a large box want wide bins, many want narrow ones (a thousand grains in
// 24 m2: 1.7 ms a run less than with half a million bins, a hundred thousand: 20 ms less). It depends on the number of
// spheres only, so that a restarted worker chooses alike.
static double script_bin(const dem_shared *s, int n_sphere) {
    const double most = 8e6, per_bin = 2.3, per_pair = 2.0, per_visit = 1.0; // ns
    double reach = 2 * s->max_radius + script_skin(s), size[2] = {s->hi[0] - s->lo[0], s->hi[1] - s->lo[1]};
    const bool space = s->dim == 3;
    const double depth = space ? s->hi[2] - s->lo[2] : s->period;
    // LIGGGHTS refuses a bin a hundred times as wide as the box is somewhere
    double best = 0, least = INFINITY, widest = 20 * fmin(depth, fmin(size[0], size[1]));
    for (double bin = reach / 2; best == 0 || bin < widest; bin *= 1.25) {
        double layers = fmax(1, floor(depth / bin)), bins = (size[0] / bin + 1) * (size[1] / bin + 1) * layers;
        double across = 2 * ceil(reach / bin) + 1, packed = across * bin / (2 * s->max_radius);
        double cost = per_bin * bins + per_pair * n_sphere * fmin(packed * packed * (space ? packed : 1), n_sphere) / 2 +
                      per_visit * n_sphere * across * across * fmin(across, layers) / 2;
        if (bins <= most && cost < least) {
            least = cost;
            best = bin;
        }
    }
    return best;
}

void script_open(void *lmp, const dem_shared *s, const char *restart, int *plane) {
    script_say(lmp, "units si");
    script_say(lmp, "atom_style sphere");
    script_say(lmp, "atom_modify map array sort 0 0");
    script_say(lmp, "boundary %c %c %c", s->periodic ? 'p' : 'f', s->across ? 'p' : 'f', s->dim == 3 ? 'f' : 'p');
    script_say(lmp, "newton off");
    script_say(lmp, "communicate single vel yes");
    script_say(lmp, "processors 1 1 1");
    if (s->resume) {
        script_say(lmp, "read_restart %s", restart);
    } else {
        script_say(lmp, "region box block %.17g %.17g %.17g %.17g %.17g %.17g units box", s->lo[0], s->hi[0], s->lo[1],
                   s->hi[1], script_low(s), script_high(s));
        script_say(lmp, "create_box %d box", DEM_TYPE_DEAD);
    }
    // not `multi`: it finds no pairs at all in this LIGGGHTS
    script_say(lmp, "neighbor %.17g bin", script_skin(s));
    script_say(lmp, "neigh_modify delay 0 every 1 check yes binsize %.17g", script_bin(s, 1));
    script_say(lmp, "neigh_modify exclude type %d %d", DEM_TYPE_FROZEN, DEM_TYPE_FROZEN);
    script_say(lmp, "neigh_modify exclude type %d %d", DEM_TYPE_FROZEN, DEM_TYPE_FIXED_BODY);
    script_say(lmp, "neigh_modify exclude type %d %d", DEM_TYPE_FIXED_BODY, DEM_TYPE_FIXED_BODY);
    script_materials(lmp, s);
    script_say(lmp, "timestep %.17g", s->step);
    double g = s->dim == 3 ? sqrt(s->gravity[0] * s->gravity[0] + s->gravity[1] * s->gravity[1] + s->gravity[2] * s->gravity[2])
                           : hypot(s->gravity[0], s->gravity[1]);
    if (g > 0)
        script_say(lmp, "fix grav all gravity %.17g vector %.17g %.17g %.17g", g, s->gravity[0] / g, s->gravity[1] / g,
                   s->dim == 3 ? s->gravity[2] / g : 0);
    script_walls(lmp, s, plane);
    // sees the forces of contacts; the water's come after it
    script_say(lmp, "fix imp all external pf/callback 1 1000000000");
    // the force on a sphere or, through one of its spheres, on a body; has to stand before the bodies
    script_say(lmp, "fix cfd all couple/cfd couple_every 0 mpi");
    script_say(lmp, "fix cff all couple/cfd/force");
    script_say(lmp, "thermo_style custom step atoms");
    script_say(lmp, "thermo 1000000000");
    script_say(lmp, "thermo_modify lost ignore norm no");
}

static void script_groups(void *lmp) {
    script_say(lmp, "group grains type %d", DEM_TYPE_GRAIN);
    script_say(lmp, "group frozen type %d %d", DEM_TYPE_FROZEN, DEM_TYPE_FIXED_BODY);
}

void script_integrate(void *lmp, const dem_shared *s, const char *path, int fd) {
    const dem_body *body = DEM_SECTION(s, const dem_body, body);
    const double *sphere = DEM_SECTION(s, const double, body_sphere);

    for (int k = 0; k < s->n_body; k++) {
        const dem_body *b = &body[k];
        FILE *file = script_file(fd);
        double volume = 0;
        for (int i = b->first; i < b->first + b->n_sphere; i++) {
            const double *p = &sphere[(s->dim == 3 ? 4 : 3) * i], radius = p[s->dim == 3 ? 3 : 2];
            fprintf(file, "%.17g %.17g %.17g %.17g\n", p[0], p[1], s->dim == 3 ? p[2] : 0, radius);
            volume += 4.0 / 3.0 * M_PI * radius * radius * radius;
        }
        script_file_close(file);
        // mass and inertia as given, in the slab no motion out of the plane; use_density keeps the given origin as the centroid
        const double plane[6] = {b->inertia, b->inertia, b->inertia, 0, 0, 0}, *t = s->dim == 3 ? b->tensor : plane;
        script_say(
            lmp,
            "fix pt%d all particletemplate/multisphere %d atom_type %d density constant %.17g nspheres %d ntry %d "
            "spheres file %s scale 1.0 type %d mass %.17g inertia_tensor %.17g %.17g %.17g %.17g %.17g %.17g use_density "
            "fflag on on %s tflag %s on",
            k, script_prime(3 * k), DEM_TYPE_BODY, b->mass / volume, b->n_sphere, s->dim == 3 ? 10000 : 100000, path, k + 1, b->mass,
            t[0], t[3], t[4], t[1], t[5], t[2], s->dim == 3 ? "on" : "off", s->dim == 3 ? "on on" : "off off");
        script_say(lmp, "fix pd%d all particledistribution/discrete %d 1 pt%d 1.0", k, script_prime(3 * k + 1), k);
    }
    if (s->n_body)
        script_say(lmp, "fix ms all multisphere allow_group_and_set yes");
    script_groups(lmp);
    // frozen spheres count as infinitely heavy in contacts: without it they would damp as if they moved
    script_say(lmp, "fix freeze frozen freeze");
    script_say(lmp, "fix nve grains nve/sphere");
}

void script_insert(void *lmp, const dem_shared *s, int k) {
    const dem_body *b = &DEM_SECTION(s, const dem_body, body)[k];
    const double plane[4] = {cos(b->angle / 2), 0, 0, sin(b->angle / 2)}, *q = s->dim == 3 ? b->q : plane;
    const double on = s->dim == 3 ? 1 : 0; // third coordinates count
    // a place within rounding; far out that is more
    const double far = fmax(fmax(fabs(b->x[0]), fabs(b->x[1])), on * fabs(b->x[2]));
    script_say(lmp, "region rg sphere %.17g %.17g %.17g %.17g volume_limit 1e-60 units box", b->x[0], b->x[1], on * b->x[2],
               far < 8 ? 1e-15 : 1e-15 * far);
    script_say(
        lmp,
        "fix in all insert/pack seed %d distributiontemplate pd%d maxattempt 5 verbose no insert_every once "
        "overlapcheck no "
        "all_in no vel constant %.17g %.17g %.17g omega constant %.17g %.17g %.17g orientation constant %.17g %.17g %.17g %.17g region rg "
        "ntry_mc 1001 particles_in_region 1",
        script_prime(3 * k + 2), k, b->v[0], b->v[1], on * b->v[2], on * b->omega[0], on * b->omega[1], b->omega[2], q[0], q[1], q[2], q[3]);
    // a step so short that nothing moves
    script_say(lmp, "timestep 1e-30");
    script_say(lmp, "run 1 pre yes post no");
    script_say(lmp, "timestep %.17g", s->step);
    script_say(lmp, "unfix in");
    script_say(lmp, "region rg delete");
}

void script_delete(void *lmp) {
    script_say(lmp, "group dead type %d", DEM_TYPE_DEAD);
    script_say(lmp, "delete_atoms group dead compress no");
}

void script_add(void *lmp, const dem_shared *s, const char *path, int fd) {
    const dem_add *add = DEM_SECTION(s, const dem_add, add);
    FILE *file = script_file(fd);
    fprintf(file,
            "spheres\n\n%d atoms\n%d atom types\n%.17g %.17g xlo xhi\n%.17g %.17g ylo yhi\n%.17g %.17g zlo "
            "zhi\n\nAtoms\n\n",
            s->n_add, DEM_TYPE_DEAD, s->lo[0], s->hi[0], s->lo[1], s->hi[1], script_low(s), script_high(s));
    for (const dem_add *a = add; a < add + s->n_add; a++)
        fprintf(file, "%d %d %.17g %.17g %.17g %.17g %.17g\n", a->tag, a->type, 2 * a->radius, a->density, a->x[0], a->x[1],
                s->dim == 3 ? a->x[2] : 0);
    fprintf(file, "\nVelocities\n\n");
    for (const dem_add *a = add; a < add + s->n_add; a++)
        if (s->dim == 3)
            fprintf(file, "%d %.17g %.17g %.17g %.17g %.17g %.17g\n", a->tag, a->v[0], a->v[1], a->v[2], a->omega[0], a->omega[1],
                    a->omega[2]);
        else
            fprintf(file, "%d %.17g %.17g 0 0 0 %.17g\n", a->tag, a->v[0], a->v[1], a->omega[2]);
    script_file_close(file);
    script_say(lmp, "read_data %s add", path);
    script_groups(lmp);
}

void script_set_up(void *lmp, const dem_shared *s) {
    script_say(lmp, "neigh_modify binsize %.17g", script_bin(s, lammps_get_natoms(lmp)));
    script_say(lmp, "run 0 pre yes post no");
}

void script_run(void *lmp, int n_step) {
    script_say(lmp, "run %d pre no post no", n_step);
}

void script_save(void *lmp, const char *restart) {
    script_say(lmp, "write_restart %s", restart);
}
