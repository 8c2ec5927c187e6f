// Kinds of changes between two sessions.
#pragma once

#include <cstdint>

namespace unimapper {

/// What became of an object between two sessions.
enum class ChangeKind : std::uint8_t { kAppeared, kGone, kMoved };

inline constexpr ChangeKind kChangeKinds[] = {ChangeKind::kAppeared, ChangeKind::kGone,
                                              ChangeKind::kMoved};

/// "appeared", "gone" or "moved": the word in files.
[[nodiscard]] constexpr const char* kind_name(ChangeKind kind) noexcept {
  switch (kind) {
    case ChangeKind::kAppeared:
      return "appeared";
    case ChangeKind::kGone:
      return "gone";
    case ChangeKind::kMoved:
      break;
  }
  return "moved";
}

}  // namespace unimapper
