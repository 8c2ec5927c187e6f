#include "unimapper/merge/keyframe_record.hpp"
