// Forgeries of messages between robots and base.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "ports/lcm/messages.hpp"

namespace unimapper::bench {

/// Sends forged messages: in answer to what it overhears, and on its own.
class Forgery {
 public:
  /// Puts one message on the network.
  using Send = std::function<void(std::string_view channel, wire::Bytes message)>;

  explicit Forgery(Send send) : send_(std::move(send)) {}
  virtual ~Forgery() = default;
  Forgery(const Forgery&) = delete;
  Forgery& operator=(const Forgery&) = delete;

  /// A message was overheard, taken out of its envelope if it was in one. Own ones are overheard,
  /// too.
  virtual void overhear(std::string_view channel, wire::Bytes message) = 0;
  /// Whether whole datagrams are overheard instead, and what is sent are datagrams.
  [[nodiscard]] virtual bool is_of_datagrams() const { return false; }
  /// Sends on its own, about `bytes` at most. Called all the time.
  virtual void act(double now_s, std::size_t bytes) = 0;

 protected:
  Send send_;
};

/// By name: bad-pieces, sessions, ended, ended-again, renamed, shifted, replay, pieces, keyframes,
/// acknowledgements. Null for another.
std::unique_ptr<Forgery> make_forgery(const std::string& name, Forgery::Send send);

/// All names.
std::vector<std::string> forgery_names();

}  // namespace unimapper::bench
