#include "ports/delivery/authentication.hpp"

#include <atomic>
#include <cerrno>
#include <optional>
#include <string_view>

#include "ports/delivery/refusal.hpp"
#include "ports/keys/guards.hpp"
#include "ports/keys/key_files.hpp"
#include "ports/keys/signature.hpp"

namespace unimapper::delivery {

namespace {

/// A robot's guard whose refusals may be read while it is in use.
class CountingGuard : public lcm_port::DatagramGuard {
 public:
  CountingGuard(const keys::RobotKey& key, const BootId& boot,
                std::shared_ptr<std::atomic<std::uint64_t>> refused)
      : guard_(key, boot), refused_(std::move(refused)) {}

  std::optional<std::vector<std::uint8_t>> seal(std::string_view channel,
                                                wire::Bytes message) override {
    return guard_.seal(channel, message);
  }
  std::optional<wire::Bytes> open(std::string_view channel, wire::Bytes datagram) override {
    const auto message = guard_.open(channel, datagram);
    refused_->store(guard_.counters().refused(), std::memory_order_relaxed);
    return message;
  }
  bool accepts(const SessionId& session, wire::Bytes keyframe) override {
    return guard_.accepts(session, keyframe);
  }

 private:
  keys::RobotGuard guard_;
  std::shared_ptr<std::atomic<std::uint64_t>> refused_;
};

class RobotAuthentication : public Authentication {
 public:
  explicit RobotAuthentication(const keys::RobotKey& key) : key_(key), signer_(key) {}

  [[nodiscard]] std::uint32_t robot() const override { return key_.robot; }
  [[nodiscard]] std::shared_ptr<lcm_port::DatagramGuard> guard(const BootId& boot) override {
    return std::make_shared<CountingGuard>(key_, boot, refused_);
  }
  void sign(std::vector<std::uint8_t>& keyframe) const override { signer_.sign(keyframe); }
  [[nodiscard]] std::uint64_t refused() const override {
    return refused_->load(std::memory_order_relaxed);
  }

 private:
  const keys::RobotKey key_;
  const keys::KeyframeSigner signer_;
  std::shared_ptr<std::atomic<std::uint64_t>> refused_ =
      std::make_shared<std::atomic<std::uint64_t>>(0);
};

}  // namespace

std::unique_ptr<Authentication> read_authentication(const std::filesystem::path& key_file) {
  try {
    return std::make_unique<RobotAuthentication>(keys::read_robot_key(key_file));
  } catch (const keys::KeyError& error) {
    throw Refusal(EACCES, error.what());
  }
}

}  // namespace unimapper::delivery
