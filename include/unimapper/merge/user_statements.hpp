// Statements of people about sessions and loops.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "unimapper/core/ids.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/merge/known_position.hpp"

namespace unimapper::merge {

/// Two keyframes that show the same surroundings, by a person's word.
struct KeyframeLink {
  KeyframeId query;                   ///< one keyframe of the link
  KeyframeId match;                   ///< the other keyframe of the link
  std::optional<Pose> T_match_query;  ///< between levelled keyframe frames, as far as known
};

/// A loop by its keyframes; which of them was searched for makes no difference.
struct KeyframePair {
  KeyframeId a;  ///< one keyframe of the loop
  KeyframeId b;  ///< the other keyframe of the loop
};

/// Statements that a merge obeys. Sessions by their index.
struct UserStatements {
  std::vector<KeyframeLink> links;           ///< loops, whatever the acceptance rules say
  std::vector<KeyframePair> forbidden;       ///< loops that are wrong
  std::vector<std::uint32_t> apart;          ///< sessions that stay apart from the map
  std::optional<std::uint32_t> reference{};  ///< the session whose frame is the map's
  std::vector<KnownPosition> positions{};    ///< of keyframes; at most one of each

  /// Whether a loop between these two is wrong, by a person's word.
  [[nodiscard]] bool forbid(KeyframeId query, KeyframeId match) const;
  /// Whether a session stays apart.
  [[nodiscard]] bool keep_apart(std::uint32_t session) const;
};

/// Reasons in the decisions on loops and sessions.
inline constexpr const char* kLinkedByPerson = "linked by a person";
inline constexpr const char* kForbiddenByPerson = "forbidden by a person";
inline constexpr const char* kApartByPerson = "kept apart by a person";

}  // namespace unimapper::merge
