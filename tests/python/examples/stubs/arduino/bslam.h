// As in the library's archive: Arduino looks for headers at its top, and in no folder below.
#include "bslam/bslam.h"
