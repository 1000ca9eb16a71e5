// tables: any bytes are refused with the file's name, or are a table whose rows can be looked up
#include "fuzz.h"
#include "scene.h"

static void look_up(silt_series *series) {
    silt_error err = {0};
    if (silt_series_rising(series, &err) != SILT_OK) {
        FUZZ_HOLDS(strstr(err.text, "table.csv"));
        return;
    }
    const int m = series->n_column, last = series->n_row - 1;
    for (int c = 0; c < m; c++) {
        FUZZ_HOLDS(silt_series_column(series, series->name[c]) == c);
        for (int i = 0; i <= last; i++)
            FUZZ_HOLDS(silt_series_at(series, c, series->value[i * m]) == series->value[i * m + c]);
    }
    double place[4];
    silt_path_settle(series, 1, BASELINE_PLACE);
    silt_path_at(series, series->value[0] / 2 + series->value[last * series->n_column] / 2, place);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    silt_series series;
    silt_error err = {0};
    fuzz_folder_make();
    const char *path = fuzz_file("table.csv", data, size);
    const silt_status status = silt_series_read(NULL, path, &series, &err);
    FUZZ_HOLDS(status == SILT_OK || (status == SILT_INPUT && strstr(err.text, "table.csv")));
    if (status == SILT_OK) {
        FUZZ_HOLDS(series.n_row > 0 && series.n_column > 0);
        look_up(&series);
    }
    silt_series_clear(&series);
    return 0;
}
