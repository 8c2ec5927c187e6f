#include "unimapper/place/config.hpp"
