#include "ports/lcm/shared_link.hpp"

#include <deque>
#include <list>
#include <mutex>
#include <utility>

namespace unimapper::lcm_port {

namespace {

/// Bases say everything again five times a second.
constexpr std::size_t kMostMessages = 1024;

}  // namespace

/// The network and what each of its users has not taken yet.
class SharedLink::Network {
 public:
  /// Of one user.
  struct Messages {
    std::deque<StoredMessage> stored;
    std::deque<ReceivedReceipt> receipts;
    std::deque<ReceivedMapPose> map_poses;
  };

  explicit Network(Link link) : link_(std::move(link)) {}

  [[nodiscard]] bool has_way_back() const { return static_cast<bool>(link_.receive); }
  [[nodiscard]] bool has_receipts() const { return static_cast<bool>(link_.receipts); }
  [[nodiscard]] bool has_map_poses() const { return static_cast<bool>(link_.map_poses); }

  Messages& add_user() {
    const std::lock_guard lock(mutex_);
    return users_.emplace_back();
  }

  bool send(std::string_view channel, Bytes message) {
    const std::lock_guard lock(mutex_);
    return link_.send(channel, message);
  }

  std::vector<StoredMessage> receive(Messages& user) {
    const std::lock_guard lock(mutex_);
    return share_out(link_.receive(), user, &Messages::stored);
  }
  std::vector<ReceivedReceipt> receipts(Messages& user) {
    const std::lock_guard lock(mutex_);
    return share_out(link_.receipts(), user, &Messages::receipts);
  }
  std::vector<ReceivedMapPose> map_poses(Messages& user) {
    const std::lock_guard lock(mutex_);
    return share_out(link_.map_poses(), user, &Messages::map_poses);
  }

 private:
  /// Everybody gets what arrived; returns what this user has not taken yet.
  template <typename Message>
  std::vector<Message> share_out(const std::vector<Message>& arrived, Messages& user,
                                 std::deque<Message> Messages::*list) {
    for (const Message& message : arrived) {
      for (Messages& each : users_) {
        if ((each.*list).size() >= kMostMessages) (each.*list).pop_front();
        (each.*list).push_back(message);
      }
    }
    std::vector<Message> taken(std::make_move_iterator((user.*list).begin()),
                               std::make_move_iterator((user.*list).end()));
    (user.*list).clear();
    return taken;
  }

  const Link link_;
  std::mutex mutex_;
  std::list<Messages> users_;  // which stay where they are
};

SharedLink::SharedLink(Link link) : network_(std::make_shared<Network>(std::move(link))) {}

Link SharedLink::share() {
  const std::shared_ptr<Network> network = network_;
  Link link;
  link.send = [network](std::string_view channel, Bytes message) {
    return network->send(channel, message);
  };
  if (!network->has_way_back()) return link;
  Network::Messages& user = network->add_user();
  link.receive = [network, &user] { return network->receive(user); };
  if (network->has_receipts()) {
    link.receipts = [network, &user] { return network->receipts(user); };
  }
  if (network->has_map_poses()) {
    link.map_poses = [network, &user] { return network->map_poses(user); };
  }
  return link;
}

}  // namespace unimapper::lcm_port
