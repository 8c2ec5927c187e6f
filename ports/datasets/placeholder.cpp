#include "ports/datasets/dataset.hpp"
