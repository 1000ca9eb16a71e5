// what the module of pictures and reports shows to the program
#include "output.h"

__attribute__((visibility("default"))) const silt_pictures *silt_pictures_table(void);

const silt_pictures *silt_pictures_table(void) {
    static const silt_pictures table = {silt_draw, silt_report};
    return &table;
}
