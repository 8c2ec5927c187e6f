// An include of every kind that the check of the layers must refuse.
#include "unimapper/onboard/upward.hpp"

#include <mutex.h>

#include <Eigen/Core>
#include <cmath>

#include "../onboard/hidden.hpp"
#include "unimapper/core/missing.hpp"
