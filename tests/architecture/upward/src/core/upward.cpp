// An include of every kind that the check of the layers must refuse.
#include <Eigen/Core>
#include <cmath>
#include <mutex.h>

#include "../onboard/hidden.hpp"
#include "unimapper/core/missing.hpp"
#include "unimapper/onboard/upward.hpp"
