/// Frames of the serial link.
#include "link/parser.h"
