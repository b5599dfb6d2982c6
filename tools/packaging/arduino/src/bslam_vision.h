/// Images to sightings.
#include "vision/vision.h"
