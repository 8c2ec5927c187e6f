// Sessions as Python holds them.
#pragma once

#include <string>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::python {

/// A session, read or being put together. It is used with the GIL held alone.
struct Session {
  SessionData data;
  bool is_prepared = false;  ///< levelled, its name fit for files; nothing is added any more
};

}  // namespace unimapper::python
