// Tests of base processes that are killed or whose disk is full, and a robot that resends.
#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <set>

#include "ports/lcm/messages.hpp"
#include "ports/lcm/sending.hpp"
#include "tests/ports/store/base.hpp"
#include "tests/ports/store/frames.hpp"
#include "tests/ports/store/memory_folder.hpp"

extern char** environ;

using namespace unimapper;
using namespace unimapper::store;
using namespace unimapper::store::store_test;
using wire_test::Random;

namespace {

const SessionInfo kAlpha{{1, 11}, "alpha", "os2-128"};
constexpr std::uint32_t kCells = 40;

/// A robot that keeps every keyframe until it is acknowledged, and sends all of those again to each
/// base that starts.
class Robot {
 public:
  explicit Robot(std::uint32_t keyframes) : keyframes_(keyframes) {
    for (std::uint32_t sequence = 0; sequence < keyframes; ++sequence) {
      const auto record = wire_test::keyframe_of(kAlpha.id, sequence, kCells);
      bytes_.push_back(wire::encode_keyframe(record));
      messages_.push_back(lcm_port::cut_into_messages(wire_test::encode_for_sending(record), 1300));
    }
  }
  [[nodiscard]] std::vector<std::uint8_t> announcement() const {
    return Frames::frame(lcm_port::kSessionChannel,
                         lcm_port::encode({kAlpha, wire::SessionState::kRunning, keyframes_, 0}));
  }
  /// What is not acknowledged, in the order of sending.
  [[nodiscard]] std::vector<std::vector<std::uint8_t>> to_send() const {
    std::vector<std::vector<std::uint8_t>> frames;
    for (std::uint32_t sequence = 0; sequence < keyframes_; ++sequence) {
      if (acknowledged.count(sequence) > 0) continue;
      for (const auto& message : messages_[sequence]) {
        frames.push_back(Frames::frame(lcm_port::kKeyframeChannel, message));
      }
    }
    return frames;
  }
  void take(const Frames::Frame& frame) {
    const auto message = lcm_port::decode_stored(frame.data);
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
  [[nodiscard]] bool is_done() const { return acknowledged.size() == keyframes_; }
  /// Whatever was acknowledged is stored, as it was sent.
  void check_acknowledged(const std::filesystem::path& folder) const {
    if (acknowledged.empty()) return;  // there may be no store yet
    const auto stored = stored_bytes(folder);
    for (const std::uint32_t sequence : acknowledged) {
      const auto keyframe = stored.find({kAlpha.id, sequence});
      REQUIRE(keyframe != stored.end());
      REQUIRE(keyframe->second == bytes_[sequence]);
    }
    REQUIRE(stored.size() <= keyframes_);
  }

  std::set<std::uint32_t> acknowledged;

 private:
  std::uint32_t keyframes_;
  std::vector<std::vector<std::uint8_t>> bytes_;
  std::vector<std::vector<std::vector<std::uint8_t>>> messages_;
};

/// A base process.
class BaseProcess {
 public:
  explicit BaseProcess(const std::filesystem::path& folder,
                       const std::string& bytes_per_file = {}) {
    int to_base[2];
    int from_base[2];
    REQUIRE(pipe2(to_base, O_CLOEXEC) == 0);
    REQUIRE(pipe2(from_base, O_CLOEXEC) == 0);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, to_base[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, from_base[1], STDOUT_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    std::vector<std::string> words{STORE_PROGRAM, folder.string()};
    if (!bytes_per_file.empty()) words.push_back(bytes_per_file);
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    REQUIRE(posix_spawn(&process_, STORE_PROGRAM, &actions, nullptr, argv.data(), environ) == 0);
    posix_spawn_file_actions_destroy(&actions);
    close(to_base[0]);
    close(from_base[1]);
    input_ = to_base[1];
    output_ = from_base[0];
  }
  ~BaseProcess() {
    close(input_);
    close(output_);
    if (process_ > 0) (void)end(SIGKILL);
  }
  BaseProcess(const BaseProcess&) = delete;
  BaseProcess& operator=(const BaseProcess&) = delete;

  /// False if the process is gone.
  [[nodiscard]] bool send(const std::vector<std::uint8_t>& frame) const {
    return write(input_, frame.data(), frame.size()) == static_cast<ssize_t>(frame.size());
  }
  /// Hands the robot what is said within so many milliseconds.
  void hear(Robot& robot, int milliseconds) {
    pollfd output{output_, POLLIN, 0};
    if (poll(&output, 1, milliseconds) > 0) (void)frames_.read_from(output_);
    while (const auto frame = frames_.next()) robot.take(*frame);
  }
  /// The process's status.
  int end(int signal) {
    kill(process_, signal);
    int status = 0;
    REQUIRE(waitpid(process_, &status, 0) == process_);
    process_ = 0;
    return status;
  }
  [[nodiscard]] bool is_running() const { return waitpid(process_, nullptr, WNOHANG) == 0; }

 private:
  pid_t process_ = 0;
  int input_ = -1;
  int output_ = -1;
  Frames frames_;
};

/// Runs until everything is acknowledged, or so many times nothing more was.
void deliver(BaseProcess& base, Robot& robot, int patience) {
  for (const auto& frame : robot.to_send()) {
    REQUIRE(base.send(frame));
    base.hear(robot, 0);
  }
  for (int i = 0; i < patience && !robot.is_done(); ++i) {
    REQUIRE(base.send(robot.announcement()));
    base.hear(robot, 20);
  }
}

}  // namespace

TEST_CASE("a base that is killed again and again loses nothing and stores nothing twice") {
  std::signal(SIGPIPE, SIG_IGN);
  const MemoryFolder folder;
  Robot robot(400);
  Random random(17);
  std::set<std::size_t> steps;
  for (int kill_number = 0; kill_number < 40; ++kill_number) {
    BaseProcess base(folder.path());
    REQUIRE(base.send(robot.announcement()));
    // Mostly once it runs, however slow the machine is; now and then while it starts.
    if (kill_number % 4 != 0) base.hear(robot, 10000);
    const std::vector<std::vector<std::uint8_t>> frames = robot.to_send();
    // Somewhere: before the first message, within a keyframe, in a commit, after an answer.
    std::size_t left = random.below(60);
    for (const auto& frame : frames) {
      if (left-- == 0) break;
      REQUIRE(base.send(frame));
      if (random.below(4) == 0) base.hear(robot, static_cast<int>(random.below(3)));
    }
    base.hear(robot, static_cast<int>(random.below(12)));
    (void)base.end(SIGKILL);
    robot.check_acknowledged(folder.path());
    steps.insert(robot.acknowledged.size());
  }
  CHECK(steps.size() > 5);
  CHECK_FALSE(robot.is_done());
  BaseProcess base(folder.path());
  deliver(base, robot, 500);
  CHECK(robot.is_done());
  (void)base.end(SIGKILL);
  robot.check_acknowledged(folder.path());
  CHECK(stored_bytes(folder.path()).size() == 400);
  CHECK(StoreReader(folder.path()).check().empty());
}

TEST_CASE("a base whose disk is full goes on running and acknowledges what it has stored") {
  std::signal(SIGPIPE, SIG_IGN);
  const MemoryFolder folder;
  Robot robot(300);
  {
    BaseProcess base(folder.path(), "450000");
    deliver(base, robot, 20);
    CHECK(base.is_running());
    CHECK_FALSE(robot.is_done());
    CHECK_FALSE(robot.acknowledged.empty());
    (void)base.end(SIGKILL);
  }
  robot.check_acknowledged(folder.path());
  BaseProcess base(folder.path());
  deliver(base, robot, 500);
  CHECK(robot.is_done());
  robot.check_acknowledged(folder.path());
}
