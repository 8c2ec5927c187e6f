// Public header of a higher layer.
#include "src/onboard/hidden.hpp"
