/// The estimator. Arduino looks for headers here, and in no folder below.
#include "bslam/bslam.h"
