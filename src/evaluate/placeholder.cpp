#include "unimapper/core/pose.hpp"
