// Names of streams and subjects that a fleet uses.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "unimapper/core/ids.hpp"

namespace unimapper::nats_port {

/// Stream of what sites send to the centre.
inline constexpr const char* kKeyframeStream = "KEYFRAMES";
/// Its subjects.
inline constexpr const char* kKeyframeSubjects = "unimapper.*.*.*.keyframe.*";
inline constexpr const char* kSessionSubjects = "unimapper.*.*.*.session";
/// Stream of what every site says of itself, the latest of each.
inline constexpr const char* kSiteStream = "SITES";
/// Its subjects, unimapper.SITE.status.
inline constexpr const char* kSiteSubjects = "unimapper.*.status";
/// The centre's consumer.
inline constexpr const char* kCentre = "centre";

/// What a message is about.
struct Subject {
  std::string site;                       ///< name of the site that sent it
  SessionId session;                      ///< identity of the session
  std::optional<std::uint32_t> sequence;  ///< of a keyframe; empty: the session itself
};

/// Whether it may be a part of a subject: 1 to 64 letters, digits, '_' or '-'.
bool is_site_name(std::string_view name);
/// unimapper.SITE.ROBOT.BOOT.keyframe.NUMBER or unimapper.SITE.ROBOT.BOOT.session.
std::string to_text(const Subject& subject);
/// The reverse, exactly; nothing for any other text.
std::optional<Subject> parse_subject(std::string_view text);

}  // namespace unimapper::nats_port
