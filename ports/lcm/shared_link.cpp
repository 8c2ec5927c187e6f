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
  using Messages = std::deque<StoredMessage>;

  explicit Network(Link link) : link_(std::move(link)) {}

  [[nodiscard]] bool has_way_back() const { return static_cast<bool>(link_.receive); }

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
    for (const StoredMessage& message : link_.receive()) {
      for (Messages& each : users_) {
        if (each.size() >= kMostMessages) each.pop_front();
        each.push_back(message);
      }
    }
    std::vector<StoredMessage> taken(std::make_move_iterator(user.begin()),
                                     std::make_move_iterator(user.end()));
    user.clear();
    return taken;
  }

 private:
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
  return link;
}

}  // namespace unimapper::lcm_port
