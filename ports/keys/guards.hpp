// Guards of the datagrams of a robot and of a base.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <string>
#include <vector>

#include "ports/keys/datagram_code.hpp"
#include "ports/keys/key.hpp"
#include "ports/keys/replay_window.hpp"
#include "ports/lcm/datagram_guard.hpp"
#include "ports/lcm/envelope.hpp"

namespace unimapper::keys {

/// What became of the datagrams that arrived.
struct GuardCounters {
  std::uint64_t accepted = 0;       ///< right code, new number
  std::uint64_t without_code = 0;   ///< in no envelope, or a damaged one
  std::uint64_t unknown_robot = 0;  ///< of a robot without a key here
  std::uint64_t revoked = 0;        ///< of a robot whose key is revoked
  std::uint64_t wrong_code = 0;     ///< made with another key, or changed
  std::uint64_t replayed = 0;       ///< a datagram that came before, or one that is far too late
  std::uint64_t other_robot = 0;    ///< right code, but the message within is of another robot
  std::uint64_t unsigned_keyframes = 0;  ///< whole, but without this robot's signature

  /// Everything that was refused.
  [[nodiscard]] std::uint64_t refused() const {
    return without_code + unknown_robot + revoked + wrong_code + replayed + other_robot +
           unsigned_keyframes;
  }
};

/// The counters that are not zero, in words; empty if nothing was refused.
[[nodiscard]] std::string describe(const GuardCounters& counters);

/// The datagrams of one sender that were seen, by its starts. Holds at most `kMaxBoots` of them:
/// only who knows the key makes it hold one more.
class SeenDatagrams {
 public:
  static constexpr std::size_t kMaxBoots = 16;

  /// The coder of a start, if one of its datagrams was accepted.
  [[nodiscard]] const DatagramCoder* find(const BootId& boot) const;
  /// Takes note of a datagram whose code is right. False if it was here before.
  bool insert(const BootId& boot, const DatagramCoder& coder, std::uint64_t number);

 private:
  struct Boot {
    BootId boot;
    DatagramCoder coder;
    ReplayWindow window;
  };
  std::list<Boot> boots_;  ///< the one heard last first
};

/// A robot's end: what it sends has its code, and it hears only bases that know its key.
class RobotGuard : public lcm_port::DatagramGuard {
 public:
  /// `boot`: of this start, as in its messages; never used with this key before.
  RobotGuard(const RobotKey& key, const BootId& boot);

  std::optional<std::vector<std::uint8_t>> seal(std::string_view channel,
                                                wire::Bytes message) override;
  std::optional<wire::Bytes> open(std::string_view channel, wire::Bytes datagram) override;
  /// No keyframe comes to a robot.
  bool accepts(const SessionId& session, wire::Bytes keyframe) override;

  /// What arrived so far.
  [[nodiscard]] const GuardCounters& counters() const { return counters_; }

 private:
  std::uint32_t robot_;
  LinkSecret secret_;
  BootId boot_;
  DatagramCoder coder_;
  std::uint64_t next_ = 0;
  SeenDatagrams seen_;
  GuardCounters counters_;
};

/// A base's end: hears robots whose keys it has, and answers each with that robot's key.
class BaseGuard : public lcm_port::DatagramGuard {
 public:
  /// `boot`: of this start of the base, random.
  BaseGuard(const std::vector<BaseKey>& keys, const BootId& boot);
  /// Takes the keys of a folder (`read_base_keys`), and reads them again when it has changed. A key
  /// that is revoked, or new, counts within a second. Throws KeyError now, later it keeps the keys
  /// it has.
  BaseGuard(const std::filesystem::path& folder, const BootId& boot);

  std::optional<std::vector<std::uint8_t>> seal(std::string_view channel,
                                                wire::Bytes message) override;
  std::optional<wire::Bytes> open(std::string_view channel, wire::Bytes datagram) override;
  bool accepts(const SessionId& session, wire::Bytes keyframe) override;

  /// What arrived so far.
  [[nodiscard]] const GuardCounters& counters() const { return counters_; }

 private:
  struct Robot {
    BaseKey key;
    DatagramCoder answers;
    SeenDatagrams seen;
    std::uint64_t next = 0;
  };

  void take(const std::vector<BaseKey>& keys);
  void read_again();

  BootId boot_;
  std::map<std::uint32_t, Robot> robots_;
  std::filesystem::path folder_;
  std::filesystem::file_time_type changed_;
  std::chrono::steady_clock::time_point next_look_;
  GuardCounters counters_;
};

}  // namespace unimapper::keys
