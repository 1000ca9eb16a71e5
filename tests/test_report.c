// the report's parts: base64, plots, cuts and outsides of the pictures, the numbers of the view

#include "output_folder.h"

#include "report.h"

#include <libfyaml.h>

// ---------------------------------------------------------------- text

static char *text;
static size_t text_size;
static FILE *text_open(void) {
    free(text);
    return open_memstream(&text, &text_size);
}

static void is_base64(const char *data, const char *expected) {
    FILE *to = text_open();
    silt_report_base64(to, data, strlen(data));
    fclose(to);
    assert_string_equal(text, expected);
}

static void test_base64(void **state) {
    (void)state;
    // RFC 4648, section 10
    is_base64("", "");
    is_base64("f", "Zg==");
    is_base64("fo", "Zm8=");
    is_base64("foo", "Zm9v");
    is_base64("foob", "Zm9vYg==");
    is_base64("fooba", "Zm9vYmE=");
    is_base64("foobar", "Zm9vYmFy");
    FILE *to = text_open();
    silt_html_text(to, "a<b> & \"c\"");
    fclose(to);
    assert_string_equal(text, "a&lt;b&gt; &amp; &quot;c&quot;");
}

// ---------------------------------------------------------------- plots

static void plot_text(const silt_plot *plot) {
    FILE *to = text_open();
    silt_plot_svg(to, plot);
    fclose(to);
}

// the path of the first line, and how many pens were put down in it
static const char *plot_path(int *pens) {
    const char *path = strstr(text, "stroke-linejoin=\"round\" d=\"");
    assert_non_null(path);
    path += strlen("stroke-linejoin=\"round\" d=\"");
    *pens = 0;
    for (const char *at = path; *at != '"'; at++)
        *pens += *at == 'M';
    return path;
}

// the field inside the axes, in the SVG's units
static void plot_field(double field[4]) {
    const char *at = strstr(text, "<rect x=");
    assert_non_null(at);
    assert_int_equal(sscanf(at, "<rect x=\"%lf\" y=\"%lf\" width=\"%lf\" height=\"%lf\"", field, field + 1, field + 2, field + 3), 4);
}

static void test_plot_line(void **state) {
    (void)state;
    // y = 2 x from 0 to 5: from one end of the field to the other, at 1/22 and 21/22 of its height
    const double x[] = {0, 2.5, 5}, y[] = {0, 5, 10};
    const silt_plot plot = {.title = "line", .n = 1, .line = {{"y", 3, x, y, false}}};
    double field[4], at[3][2];
    int pens;
    plot_text(&plot);
    plot_field(field);
    const char *path = plot_path(&pens);
    assert_int_equal(pens, 1);
    assert_int_equal(sscanf(path, "M%lf,%lfL%lf,%lfL%lf,%lf", at[0], at[0] + 1, at[1], at[1] + 1, at[2], at[2] + 1), 6);
    for (int k = 0; k < 3; k++) {
        near(at[k][0], field[0] + 0.5 * k * field[2], 0.5);
        near(at[k][1], field[1] + field[3] * (21 - 10 * k) / 22.0, 0.06);
    }
}

static void test_plot_thinned(void **state) {
    (void)state;
    // of 200000 rows one is 1, one -1, a thousand are missing: both are in the picture, and the gap is
    enum { N = 200000 };
    static double x[N], y[N];
    for (int i = 0; i < N; i++) {
        x[i] = i;
        y[i] = i >= 50000 && i < 51000 ? NAN : 0;
    }
    y[123456] = 1;
    y[123457] = -1;
    const silt_plot plot = {.title = "spike", .n = 1, .line = {{"y", N, x, y, false}}};
    double field[4], px, py, least = HUGE_VAL, most = -HUGE_VAL, where = 0;
    int pens, n;
    plot_text(&plot);
    plot_field(field);
    const char *path = plot_path(&pens);
    assert_int_equal(pens, 2);
    assert_true(text_size < 60000);
    for (; sscanf(path, "%*1[ML]%lf,%lf%n", &px, &py, &n) == 2; path += n) {
        if (py < least)
            where = px;
        least = silt_min(least, py), most = silt_max(most, py);
    }
    near(least, field[1] + field[3] / 22, 0.06);
    near(most, field[1] + field[3] * 21 / 22, 0.06);
    near(where, field[0] + field[2] * 123456 / (N - 1), 1);
}

static void test_plot_band(void **state) {
    (void)state;
    // allowed from 1 to 3 where x is 2 to 4, of a line from (0, 0) to (8, 4): widths by rule of three
    const double x[] = {0, 8}, y[] = {0, 4};
    const silt_plot plot = {.title = "band", .n = 1, .line = {{"y", 2, x, y, false}}, .banded = true, .band = {1, 3}, .span = {2, 4}};
    double field[4], box[4];
    plot_text(&plot);
    plot_field(field);
    const char *at = strstr(text, "class=\"allowed\"");
    assert_non_null(at);
    while (*at != '<')
        at--;
    assert_int_equal(sscanf(at, "<rect x=\"%lf\" y=\"%lf\" width=\"%lf\" height=\"%lf\"", box, box + 1, box + 2, box + 3), 4);
    near(box[0], field[0] + field[2] / 4, 0.1);
    near(box[2], field[2] / 4, 0.1);
    near(box[1], field[1] + field[3] * (4.2 - 3) / 4.4, 0.1);
    near(box[3], field[3] * 2 / 4.4, 0.1);
    // nothing but gaps: no plot
    const double none[] = {NAN, NAN};
    const silt_plot empty = {.title = "none", .n = 1, .line = {{"y", 2, x, none, false}}};
    assert_true(silt_plot_empty(&empty));
    assert_false(silt_plot_empty(&plot));
}

// ---------------------------------------------------------------- cuts and outsides

static silt_grid grid_make(int n_point, const double *x, int n_cell, int corners, const int *link) {
    silt_grid grid = {.n_point = n_point, .n_cell = n_cell};
    grid.x = silt_alloc(3 * (size_t)n_point, sizeof *grid.x);
    memcpy(grid.x, x, 3 * (size_t)n_point * sizeof *x);
    grid.offset = silt_alloc((size_t)n_cell + 1, sizeof *grid.offset);
    grid.link = silt_alloc((size_t)(n_cell * corners), sizeof *grid.link);
    memcpy(grid.link, link, (size_t)(n_cell * corners) * sizeof *link);
    for (int i = 0; i <= n_cell; i++)
        grid.offset[i] = corners * i;
    return grid;
}

static void test_outside(void **state) {
    (void)state;
    // a cube of six tetrahedra around its diagonal: twelve faces whose fluxes give its volume and 24 times nothing else
    const double x[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1};
    const int link[] = {0, 1, 3, 7, 0, 3, 2, 7, 0, 2, 6, 7, 0, 6, 4, 7, 0, 4, 5, 7, 0, 5, 1, 7};
    silt_grid grid = grid_make(8, x, 6, 4, link);
    int(*face)[3];
    assert_int_equal(silt_draw_outside(&grid, &face), 12);
    double volume = 0;
    for (int i = 0; i < 12; i++) {
        const double *a = x + 3 * face[i][0], *b = x + 3 * face[i][1], *c = x + 3 * face[i][2];
        volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6;
    }
    near(volume, 1, 1e-15);
    free(face);
    silt_grid_clear(&grid);
}

static void test_cut(void **state) {
    (void)state;
    // two spheres: the plane y = 0.3 cuts the first 0.3 off its centre, misses the second
    const double x[] = {1, 0, 2, 5, 1, 5};
    const int link[] = {0, 1};
    const silt_draw_canvas canvas = {.slice = 2, .slice_at = 0.3};
    silt_grid grid = grid_make(2, x, 2, 1, link);
    grid.radius = silt_alloc(2, sizeof *grid.radius);
    grid.radius[0] = grid.radius[1] = 0.5;
    silt_draw_slice_grains(&canvas, &grid);
    assert_int_equal(grid.n_point, 1);
    assert_int_equal(grid.n_cell, 1);
    near(grid.radius[0], 0.4, 1e-15);
    near(grid.x[0], 1, 0);
    near(grid.x[1], 2, 0);
    silt_grid_clear(&grid);

    // a tetrahedron's faces over the plane z = 0.25: a triangle with sides of 3/4 of its base's
    const double corner[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const int face[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
    const silt_draw_canvas level = {.slice = 3, .slice_at = 0.25};
    double(*line)[4], length = 0, area = 0;
    silt_grid body = grid_make(4, corner, 4, 3, face);
    assert_int_equal(silt_draw_slice_faces(&level, &body, &line), 3);
    for (int i = 0; i < 3; i++) {
        length += hypot(line[i][2] - line[i][0], line[i][3] - line[i][1]);
        area += 0.5 * fabs(line[i][0] * line[i][3] - line[i][1] * line[i][2]); // one corner lies at the origin
    }
    near(length, 0.75 * (2 + sqrt(2)), 1e-15);
    near(area, 0.5 * 0.75 * 0.75, 1e-15);
    free(line);
    silt_grid_clear(&body);
}

// ---------------------------------------------------------------- the page

// a square of two cells, a drop, two grains
static double water_x[] = {0.5, 0.25, 1.5, 0.25, 1.5, 1.25, 0.5, 1.25, 3, 1.5};
enum { WATER_NODES = 5 };
static double water_v[2 * WATER_NODES] = {0, 0, 1, 0, 2, 0, 4, 0, 0, 0}, water_p[WATER_NODES];
static int water_cell[][4] = {{0, 1, 2, -1}, {0, 2, 3, -1}};
static int64_t water_id[WATER_NODES];
static uint8_t water_kind[WATER_NODES], water_wet[] = {1, 1, 1, 1, 0};
static int64_t grain_id[] = {1, 2};
static double grain_x[] = {2, 0.5, 0, 2.5, 0.75, 0}, grain_v[6], grain_radius[] = {0.1, 0.05};

static void frames_make(int n) {
    silt_scene scene = {.fluid = {.on = true, .size = 1}, .grains = {.on = true}};
    silt_nodes nodes = {.count = WATER_NODES, .x = water_x, .v = water_v, .p = water_p, .id = water_id, .kind = water_kind};
    silt_mesh mesh = {.n_node = WATER_NODES, .n_cell = 2, .cell = water_cell, .wet = water_wet};
    silt_grain_state grains = {.count = 2, .id = grain_id, .x = grain_x, .v = grain_v, .omega = grain_v, .radius = grain_radius};
    silt_ledger ledger = {0};
    silt_view view = {.scene = &scene, .nodes = &nodes, .mesh = &mesh, .grains = &grains, .ledger = &ledger};
    silt_error err = {0};
    for (int i = 0; i < n; i++) {
        view.time = 0.5 * i;
        // the water moves, the grains do not
        for (int k = 0; k < WATER_NODES; k++)
            water_x[2 * k] += i > 0 ? 0.125 : 0;
        if (silt_frame_write(folder, i, &view, &err))
            fail_msg("%s", err.text);
    }
}

// the whole page, owned by the caller
static char *page_read(void) {
    FILE *from = fopen(place("report.html"), "r");
    assert_non_null(from);
    fseek(from, 0, SEEK_END);
    const size_t n = (size_t)ftell(from);
    char *page = silt_alloc(n + 1, 1);
    rewind(from);
    assert_int_equal(fread(page, 1, n, from), n);
    fclose(from);
    return page;
}

// numbers of a block of the view, of `width` bytes each. @return how many
static int view_numbers(struct fy_document *view, const char *path, int width, unsigned long out[32]) {
    char key[80];
    snprintf(key, sizeof key, "/blocks/%s", silt_summary_text(view, path));
    const char *letter = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/", *data = silt_summary_text(view, key);
    unsigned char byte[256];
    int n = 0;
    for (unsigned bits = 0, held = 0; *data && *data != '='; data++) {
        bits = bits << 6 | (unsigned)(strchr(letter, *data) - letter);
        held += 6;
        if (held >= 8) {
            held -= 8;
            byte[n++] = (unsigned char)(bits >> held & 255);
        }
    }
    for (int i = 0; i < n / width; i++) {
        out[i] = 0;
        for (int k = width; k-- > 0;)
            out[i] = out[i] << 8 | byte[width * i + k];
    }
    return n / width;
}

static void test_page(void **state) {
    (void)state;
    silt_error err = {0};
    const silt_report_def def = {0};
    make("scene.yaml", SCENE);
    make("curve.csv", "# drawn by hand\nt,x\n0,1\n1,2.5\n2,4\n");
    assert_int_equal(silt_report(folder, &def, NULL, &err), SILT_FAILED);
    contains(err.text, "has no frames");
    assert_false(exists("report.html"));
    frames_make(3);
    // the last row is being written
    make("history.csv", "step,time,dt,n_node,volume_error,external_work,front,wall_mesh\n0,0,0,5,0,0,1,0.25\n1,2,2,5,0.001,-21,4,0.5\n2,4,2,5,0.0");
    if (silt_report(folder, &def, NULL, &err))
        fail_msg("%s", err.text);
    char *page = page_read();
    contains(page, "<h1>A small world</h1>");
    contains(page, "it is running or was killed");
    contains(page, "2 of 10 s in 1 steps, 3 frames");
    contains(page, "Checks: 2 of 2 pass");
    contains(page, "curve.csv: drawn by hand");
    contains(page, "0.75 s of the clock in 2 steps");
    contains(page, "data:image/png;base64,iVBORw0KGgo");
    contains(page, "Volume error");
    contains(page, "silt: 1");
    assert_null(strstr(page, "grain_mass"));
    free(page);
}

// from 1 m at 0 s to 4 m at 2 s: 2.5 m at 1 s; checks that ask for the same have one picture, with both names
static void test_scalar_checks(void **state) {
    (void)state;
    silt_error err = {0};
    make("scene.yaml", SCENE "  - {name: reach, column: front, scalar: reaches, level: 2.5, value: 1, tolerance: 1.0e-9}\n"
                             "  - {name: early, column: front, scalar: at, at: 1, value: 2.5, tolerance: 1.0e-9}\n"
                             "  - {name: top, column: front, scalar: max, value: 4, tolerance: 1.0e-9}\n"
                             "  - {name: again, column: front, scalar: max, value: 4, tolerance: 1.0e-9}\n"
                             "  - {name: wide, column: front, scalar: max, value: 4, tolerance: 0.1}\n");
    make("curve.csv", "t,x\n0,1\n1,2.5\n2,4\n");
    frames_make(3);
    make("history.csv", "step,time,dt,n_node,volume_error,external_work,front,wall_mesh\n0,0,0,5,0,0,1,0.25\n1,2,2,5,0.001,-21,4,0.5\n");
    if (silt_report(folder, &(silt_report_def){0}, NULL, &err))
        fail_msg("%s", err.text);
    char *page = page_read();
    contains(page, "Checks: 7 of 7 pass");
    contains(page, ">top, again<");
    contains(page, ">wide<");
    contains(page, ">reach<");
    contains(page, ">early<");
    assert_null(strstr(page, ">top, again, wide<"));
    free(page);
}

static void test_view(void **state) {
    (void)state;
    silt_error err = {0};
    const silt_report_def def = {0};
    if (access("/usr/share/javascript/three/three.min.js", R_OK) != 0) {
        print_message("skipped, three.js is not installed\n");
        skip();
    }
    if (silt_report(folder, &def, NULL, &err))
        fail_msg("%s", err.text);
    char *page = page_read(), *data = strstr(page, "id=\"view-data\">");
    assert_non_null(data);
    data += strlen("id=\"view-data\">");
    *strstr(data, "</script>") = 0;
    struct fy_document *view = fy_document_build_from_string(&(struct fy_parse_cfg){.flags = FYPCF_QUIET | FYPCF_JSON_FORCE}, data, FY_NT);
    assert_non_null(view);
    const double step = silt_summary_number(view, "/step");
    const double lo[] = {silt_summary_number(view, "/lo/0"), silt_summary_number(view, "/lo/1")};
    unsigned long q[32];
    assert_true(step > 0 && step < 4.0 * 1.3 / 65535);
    near(silt_summary_number(view, "/frames/2/t"), 1, 0);
    // places of the last frame, where the water is now
    assert_int_equal(view_numbers(view, "/frames/2/water/x", 2, q), 3 * WATER_NODES);
    for (int i = 0; i < WATER_NODES; i++)
        for (int d = 0; d < 2; d++)
            near(lo[d] + step * (double)q[3 * i + d], water_x[2 * i + d], 0.5001 * step);
    // colours: speeds 0, 1, 2, 4 of a range from 0 to 2, the 99.5th of a hundred among these four
    near(silt_summary_number(view, "/low"), 0, 0);
    near(silt_summary_number(view, "/high"), 2, 0);
    assert_int_equal(view_numbers(view, "/frames/2/water/c", 1, q), WATER_NODES);
    for (int i = 0; i < 4; i++)
        near((double)q[i], 255 * silt_min(1, water_v[2 * i] / 2), 0.5);
    // triangles, their outer edges, the drop, the grains
    assert_int_equal(view_numbers(view, "/frames/2/water/f", 2, q), 6);
    for (int i = 0; i < 6; i++)
        assert_int_equal(q[i], water_cell[i / 3][i % 3]);
    assert_int_equal(view_numbers(view, "/frames/2/water/e", 2, q), 8);
    assert_int_equal(view_numbers(view, "/frames/2/drops/x", 2, q), 3);
    near(lo[0] + step * (double)q[0], water_x[8], 0.5001 * step);
    assert_int_equal(view_numbers(view, "/frames/2/grains/r", 2, q), 2);
    for (int i = 0; i < 2; i++)
        near(step * (double)q[i] / 16, grain_radius[i], 0.5001 * step / 16);
    // what does not move is there once, what does is not
    char grains[16], water[16];
    snprintf(grains, sizeof grains, "%s", silt_summary_text(view, "/frames/0/grains/x"));
    snprintf(water, sizeof water, "%s", silt_summary_text(view, "/frames/0/water/x"));
    assert_string_equal(grains, silt_summary_text(view, "/frames/2/grains/x"));
    assert_string_not_equal(water, silt_summary_text(view, "/frames/2/water/x"));
    assert_string_equal(silt_summary_text(view, "/frames/3/t"), "");
    silt_summary_close(view);
    free(page);

    // The first frame's blocks are 121 bytes, 185 letters and signs, those of the others 36 and 54: 98 a frame. Room for two and a half:
    // first and last stay
    const silt_report_def small = {.megabytes = 0.00025};
    if (silt_report(folder, &small, NULL, &err))
        fail_msg("%s", err.text);
    page = page_read();
    contains(page, "2 of 3 frames, evenly spread: the others are left out to keep the page small.");
    contains(page, "{\"t\":1,\"frame\":2");
    assert_null(strstr(page, "{\"t\":0.5,"));
    free(page);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_base64), cmocka_unit_test(test_plot_line), cmocka_unit_test(test_plot_thinned),
        cmocka_unit_test(test_plot_band), cmocka_unit_test(test_outside), cmocka_unit_test(test_cut),
        cmocka_unit_test(test_page), cmocka_unit_test(test_scalar_checks), cmocka_unit_test(test_view),
    };
    const int failed = cmocka_run_group_tests(tests, make_folder, remove_folder);
    free(text);
    return failed;
}
