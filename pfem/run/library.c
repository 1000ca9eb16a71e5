// the one file of libsilt that is not in the program too
#include "silt/silt.h"

const char *silt_version(void) { return SILT_VERSION; }
