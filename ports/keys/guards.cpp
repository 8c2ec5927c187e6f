#include "ports/keys/guards.hpp"

#include <sodium.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "ports/keys/key_files.hpp"
#include "ports/keys/library.hpp"
#include "ports/keys/signature.hpp"

namespace unimapper::keys {

using lcm_port::Envelope;
using wire::Bytes;

static_assert(std::tuple_size_v<Code> == lcm_port::kCodeBytes);

namespace {

constexpr std::chrono::milliseconds kLookInterval{500};

std::vector<std::uint8_t> sealed(const Envelope& envelope, const DatagramCoder& coder,
                                 std::string_view channel) {
  std::vector<std::uint8_t> bytes = lcm_port::write_envelope(envelope);
  const Code code = coder.code(channel, bytes);
  bytes.insert(bytes.end(), code.begin(), code.end());
  return bytes;
}

/// Whether the envelope is new and made with this secret; the reason is counted if not.
bool is_authentic(const Envelope& envelope, std::string_view channel, const LinkSecret& secret,
                  End end, SeenDatagrams& seen, GuardCounters& counters) {
  const DatagramCoder* known = seen.find(envelope.boot);
  const DatagramCoder coder = known != nullptr ? *known : DatagramCoder(secret, end, envelope.boot);
  // Nothing is remembered of who cannot make the code.
  if (!coder.is_code(channel, envelope.signed_bytes, envelope.code)) {
    ++counters.wrong_code;
    return false;
  }
  if (!seen.insert(envelope.boot, coder, envelope.number)) {
    ++counters.replayed;
    return false;
  }
  if (lcm_port::robot_of(envelope.message) != envelope.robot) {
    ++counters.other_robot;
    return false;
  }
  ++counters.accepted;
  return true;
}

}  // namespace

std::string describe(const GuardCounters& counters) {
  std::string text;
  const auto add = [&text](std::uint64_t count, const char* what) {
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + what;
  };
  add(counters.without_code, "without a code");
  add(counters.unknown_robot, "of robots without a key");
  add(counters.revoked, "of revoked keys");
  add(counters.wrong_code, "with a wrong code");
  add(counters.replayed, "sent before");
  add(counters.other_robot, "of one robot in the name of another");
  add(counters.unsigned_keyframes, "keyframes without a right signature");
  return text;
}

const DatagramCoder* SeenDatagrams::find(const BootId& boot) const {
  for (const Boot& known : boots_) {
    if (known.boot == boot) return &known.coder;
  }
  return nullptr;
}

bool SeenDatagrams::insert(const BootId& boot, const DatagramCoder& coder, std::uint64_t number) {
  const auto known = std::find_if(boots_.begin(), boots_.end(),
                                  [&boot](const Boot& one) { return one.boot == boot; });
  if (known != boots_.end()) {
    boots_.splice(boots_.begin(), boots_, known);
  } else {
    boots_.push_front({boot, coder, {}});
    if (boots_.size() > kMaxBoots) boots_.pop_back();
  }
  return boots_.front().window.insert(number);
}

RobotGuard::RobotGuard(const RobotKey& key, const BootId& boot)
    : robot_(key.robot), secret_(key.link), boot_(boot), coder_(key.link, End::kRobot, boot) {}

std::optional<std::vector<std::uint8_t>> RobotGuard::seal(std::string_view channel, Bytes message) {
  // Left in a spool from before this robot had its key: no base would take it.
  if (lcm_port::robot_of(message) != robot_) return std::nullopt;
  return sealed({robot_, boot_, next_++, message, {}, {}}, coder_, channel);
}

std::optional<Bytes> RobotGuard::open(std::string_view channel, Bytes datagram) {
  const auto envelope = lcm_port::read_envelope(datagram);
  if (!envelope) {
    // What a base without keys tells a robot without keys is none of ours.
    if (lcm_port::is_envelope(datagram) || lcm_port::robot_of(datagram) == robot_) {
      ++counters_.without_code;
    }
    return std::nullopt;
  }
  if (envelope->robot != robot_) return std::nullopt;  // an answer to another robot
  if (!is_authentic(*envelope, channel, secret_, End::kBase, seen_, counters_)) {
    return std::nullopt;
  }
  return envelope->message;
}

bool RobotGuard::accepts(const SessionId& /*session*/, Bytes /*keyframe*/) { return false; }

BaseGuard::BaseGuard(const std::vector<BaseKey>& keys, const BootId& boot) : boot_(boot) {
  require_library();
  take(keys);
}

BaseGuard::BaseGuard(const std::filesystem::path& folder, const BootId& boot)
    : boot_(boot), folder_(folder) {
  std::error_code unreadable;
  changed_ = std::filesystem::last_write_time(folder, unreadable);
  take(read_base_keys(folder));
  next_look_ = std::chrono::steady_clock::now() + kLookInterval;
}

/// What was seen of a robot whose key stayed the same is kept.
void BaseGuard::take(const std::vector<BaseKey>& keys) {
  std::map<std::uint32_t, Robot> robots;
  for (const BaseKey& key : keys) {
    Robot robot{key, DatagramCoder(key.link, End::kBase, boot_), {}, 0};
    const auto known = robots_.find(key.robot);
    const bool same =
        known != robots_.end() &&
        sodium_memcmp(known->second.key.link.data(), key.link.data(), LinkSecret::size()) == 0;
    if (same) {
      robot.seen = std::move(known->second.seen);
      robot.next = known->second.next;
    }
    robots.emplace(key.robot, std::move(robot));
  }
  robots_ = std::move(robots);
}

void BaseGuard::read_again() {
  if (folder_.empty()) return;
  const auto now = std::chrono::steady_clock::now();
  if (now < next_look_) return;
  next_look_ = now + kLookInterval;
  std::error_code unreadable;
  const auto changed = std::filesystem::last_write_time(folder_, unreadable);
  if (unreadable || changed == changed_) return;
  try {
    take(read_base_keys(folder_));
    changed_ = changed;
  } catch (const std::exception&) {
    // A file is being written, or is none: those of before hold, and the folder is looked at again.
  }
}

std::optional<std::vector<std::uint8_t>> BaseGuard::seal(std::string_view channel, Bytes message) {
  read_again();
  const auto robot = lcm_port::robot_of(message);
  const auto known = robot ? robots_.find(*robot) : robots_.end();
  if (known == robots_.end() || known->second.key.revoked) return std::nullopt;
  Robot& to = known->second;
  return sealed({*robot, boot_, to.next++, message, {}, {}}, to.answers, channel);
}

std::optional<Bytes> BaseGuard::open(std::string_view channel, Bytes datagram) {
  read_again();
  const auto envelope = lcm_port::read_envelope(datagram);
  if (!envelope) {
    ++counters_.without_code;
    return std::nullopt;
  }
  const auto known = robots_.find(envelope->robot);
  if (known == robots_.end()) {
    ++counters_.unknown_robot;
    return std::nullopt;
  }
  Robot& from = known->second;
  if (from.key.revoked) {
    ++counters_.revoked;
    return std::nullopt;
  }
  if (!is_authentic(*envelope, channel, from.key.link, End::kRobot, from.seen, counters_)) {
    return std::nullopt;
  }
  return envelope->message;
}

bool BaseGuard::accepts(const SessionId& session, Bytes keyframe) {
  const auto known = robots_.find(session.robot);
  const bool accepted = known != robots_.end() && !known->second.key.revoked &&
                        is_signed_by(known->second.key.verifying, keyframe);
  if (!accepted) ++counters_.unsigned_keyframes;
  return accepted;
}

}  // namespace unimapper::keys
