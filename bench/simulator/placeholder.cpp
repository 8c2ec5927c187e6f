#include "unimapper/core/sensor.hpp"
