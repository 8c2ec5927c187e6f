// A port that reaches into a lower room's private header.
#include "src/onboard/hidden.hpp"
#include "unimapper/onboard/upward.hpp"
