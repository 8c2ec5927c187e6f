// One link to the base, used by several publishers.
#pragma once

#include <memory>

#include "ports/lcm/publisher.hpp"

namespace unimapper::lcm_port {

/// Gives out links that send over one network, one message at a time, and that each receive all
/// that arrives on it. Thread safe.
class SharedLink {
 public:
  /// The network.
  explicit SharedLink(Link link);

  /// A link for one more publisher, to be used from its thread. It keeps the network alive. What
  /// arrives and is not taken is bounded: of 1,024 messages the oldest goes.
  [[nodiscard]] Link share();

 private:
  class Network;
  std::shared_ptr<Network> network_;
};

}  // namespace unimapper::lcm_port
