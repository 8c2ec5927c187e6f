// From the pipeline's keyframe to the one the base will hold.
#pragma once

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace unimapper::wire {

/// An owned copy of the pipeline's keyframe, already on the wire's grid (`quantise`), so that it
/// equals what arrives at the base, bit for bit. Allocates; a few milliseconds for the sorting
/// of 50,000 cells.
KeyframeRecord to_record(const KeyframeView& keyframe, const SessionId& session);

}  // namespace unimapper::wire
