// Test of base processes that are killed, and a robot that resends.
#include <poll.h>
#include <signal.h>  // NOLINT: kill is POSIX
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "ports/lcm/messages.hpp"
#include "ports/lcm/received_log.hpp"
#include "ports/lcm/sending.hpp"
#include "tests/ports/store/base.hpp"
#include "tests/ports/store/memory_folder.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::store;
using namespace unimapper::store::store_test;
using wire_test::Random;

namespace {

const SessionInfo kAlpha{{1, 11}, "alpha", "os2-128"};
constexpr std::uint32_t kKeyframes = 500;
constexpr std::uint32_t kCells = 40;
constexpr std::size_t kMostBytes = 65536;

/// A message, and at its end whether it is of a session or a piece of a keyframe.
using Packet = std::vector<std::uint8_t>;
enum : std::uint8_t { kSession, kPiece };

/// A robot that keeps every keyframe until it is acknowledged, and sends all of those again to each
/// base that starts.
class Robot {
 public:
  Robot() {
    for (std::uint32_t sequence = 0; sequence < kKeyframes; ++sequence) {
      const auto record = wire_test::keyframe_of(kAlpha.id, sequence, kCells);
      bytes_.push_back(wire::encode_keyframe(record));
      pieces_.push_back(lcm_port::cut_into_messages(wire_test::encode_for_sending(record), 1300));
      for (Packet& piece : pieces_.back()) piece.push_back(kPiece);
    }
  }
  static Packet announcement() {
    Packet packet = lcm_port::encode({kAlpha, wire::SessionState::kRunning, kKeyframes, 0});
    packet.push_back(kSession);
    return packet;
  }
  /// What is not acknowledged, in the order of sending.
  [[nodiscard]] std::vector<Packet> to_send() const {
    std::vector<Packet> packets;
    for (std::uint32_t sequence = 0; sequence < kKeyframes; ++sequence) {
      if (acknowledged.count(sequence) > 0) continue;
      packets.insert(packets.end(), pieces_[sequence].begin(), pieces_[sequence].end());
    }
    return packets;
  }
  void take(wire::Bytes answer) {
    const auto message = lcm_port::decode_stored(answer);
    REQUIRE(message);
    for (std::uint32_t sequence = 0; sequence < message->below; ++sequence) {
      acknowledged.insert(sequence);
    }
    for (const wire::SequenceRange& range : message->ranges) {
      for (std::uint64_t sequence = range.begin; sequence < range.end; ++sequence) {
        acknowledged.insert(static_cast<std::uint32_t>(sequence));
      }
    }
  }
  [[nodiscard]] bool is_done() const { return acknowledged.size() == kKeyframes; }
  /// Whatever was acknowledged is stored, as it was sent.
  void check_acknowledged(const std::filesystem::path& folder) const {
    if (acknowledged.empty()) return;  // there may be no store yet
    const auto stored = stored_bytes(folder);
    for (const std::uint32_t sequence : acknowledged) {
      const auto keyframe = stored.find({kAlpha.id, sequence});
      REQUIRE(keyframe != stored.end());
      REQUIRE(keyframe->second == bytes_[sequence]);
    }
    REQUIRE(stored.size() <= kKeyframes);
  }

  std::set<std::uint32_t> acknowledged;

 private:
  std::vector<std::vector<std::uint8_t>> bytes_;
  std::vector<std::vector<Packet>> pieces_;
};

/// A base on a store; answers what arrives until the robot is gone.
void serve(const std::filesystem::path& folder, int socket) {
  StoreOptions options;
  options.batch_interval_ns = 5'000'000;
  options.retry_interval_ns = 20'000'000;
  KeyframeStore store(folder, options);
  wire::Receiver receiver({}, store);
  for (;;) {
    pollfd input{socket, POLLIN, 0};
    if (poll(&input, 1, 2) > 0) {
      Packet packet(kMostBytes);
      const ssize_t bytes = recv(socket, packet.data(), packet.size(), 0);
      if (bytes <= 0) return;
      packet.resize(static_cast<std::size_t>(bytes));
      const bool is_piece = packet.back() == kPiece;
      packet.pop_back();
      lcm_port::receive(receiver, is_piece ? lcm_port::kKeyframeChannel : lcm_port::kSessionChannel,
                        packet);
    }
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    receiver.advance(std::chrono::nanoseconds(now).count());
    for (const wire::StoredMessage& message : receiver.take_stored()) {
      const Packet answer = lcm_port::encode(message);
      if (send(socket, answer.data(), answer.size(), MSG_NOSIGNAL) < 0) return;
    }
  }
}

/// A base process.
class BaseProcess {
 public:
  explicit BaseProcess(const std::filesystem::path& folder) {
    int ends[2];
    REQUIRE(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) == 0);
    process_ = fork();
    REQUIRE(process_ >= 0);
    if (process_ == 0) {
      close(ends[0]);
      try {
        serve(folder, ends[1]);
      } catch (const std::exception&) {
        _exit(1);
      }
      _exit(0);
    }
    close(ends[1]);
    socket_ = ends[0];
  }
  ~BaseProcess() {
    if (is_alive_) end();
    close(socket_);
  }
  BaseProcess(const BaseProcess&) = delete;
  BaseProcess& operator=(const BaseProcess&) = delete;

  /// False if the process is gone.
  [[nodiscard]] bool take(const Packet& packet) const {
    return send(socket_, packet.data(), packet.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(packet.size());
  }
  /// Hands the robot what is said within so many milliseconds.
  void hear(Robot& robot, int milliseconds) const {
    pollfd output{socket_, POLLIN, 0};
    if (poll(&output, 1, milliseconds) <= 0) return;
    Packet answer(kMostBytes);
    ssize_t bytes = 0;
    while ((bytes = recv(socket_, answer.data(), answer.size(), MSG_DONTWAIT)) > 0) {
      robot.take({answer.data(), static_cast<std::size_t>(bytes)});
    }
  }
  void end() {
    kill(process_, SIGKILL);
    REQUIRE(waitpid(process_, nullptr, 0) == process_);
    is_alive_ = false;
  }

 private:
  pid_t process_ = 0;
  bool is_alive_ = true;
  int socket_ = -1;
};

}  // namespace

TEST_CASE("a base that is killed again and again loses nothing and stores nothing twice") {
  const MemoryFolder folder;
  Robot robot;
  Random random(17);
  std::set<std::size_t> steps;
  // More of them where a slow machine commits little between two.
  const auto is_enough = [&](int kills) { return kills >= 40 && steps.size() > 5; };
  for (int kill_number = 0; kill_number < 400 && !is_enough(kill_number); ++kill_number) {
    BaseProcess base(folder.path());
    REQUIRE(base.take(robot.announcement()));
    // Mostly once it runs, however slow the machine is; now and then while it starts.
    if (kill_number % 4 != 0) base.hear(robot, 10000);
    // Somewhere: before the first message, within a keyframe, in a commit, after an answer.
    std::size_t left = random.below(60);
    for (const Packet& packet : robot.to_send()) {
      if (left-- == 0) break;
      REQUIRE(base.take(packet));
      if (random.below(4) == 0) base.hear(robot, static_cast<int>(random.below(3)));
    }
    const auto until =
        std::chrono::steady_clock::now() + std::chrono::milliseconds(random.below(12));
    while (std::chrono::steady_clock::now() < until) base.hear(robot, 1);
    base.end();
    robot.check_acknowledged(folder.path());
    steps.insert(robot.acknowledged.size());
  }
  CHECK(steps.size() > 5);
  CHECK_FALSE(robot.is_done());
  BaseProcess base(folder.path());
  for (const Packet& packet : robot.to_send()) {
    REQUIRE(base.take(packet));
    base.hear(robot, 0);
  }
  for (int i = 0; i < 500 && !robot.is_done(); ++i) {
    REQUIRE(base.take(robot.announcement()));
    base.hear(robot, 20);
  }
  CHECK(robot.is_done());
  base.end();
  robot.check_acknowledged(folder.path());
  CHECK(stored_bytes(folder.path()).size() == kKeyframes);
  CHECK(StoreReader(folder.path()).check().empty());
}
