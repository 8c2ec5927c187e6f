// Connection to a NATS server and its JetStream, for the sources of this port.
#pragma once

#include <nats/nats.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "ports/nats/server.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::nats_port {

/// Frees what libnats has made.
template <auto kDestroy>
struct Destroyer {
  template <typename T>
  void operator()(T* object) const {
    kDestroy(object);
  }
};
using Message = std::unique_ptr<natsMsg, Destroyer<&natsMsg_Destroy>>;
using Subscription = std::unique_ptr<natsSubscription, Destroyer<&natsSubscription_Destroy>>;

/// Throws NatsError with what was tried and the reason unless `status` is good.
void require(natsStatus status, const std::string& what);

/// Connected from construction on. Once it breaks it stays so. One thread at a time.
class Connection {
 public:
  /// Waits at most two seconds for each server. Throws NatsError, also for what `check` refuses.
  explicit Connection(const Server& server);

  /// False once it has broken.
  [[nodiscard]] bool is_open() const;
  /// Largest message that the server takes, headers included, bytes.
  [[nodiscard]] std::int64_t max_payload() const;
  /// The connection itself.
  [[nodiscard]] natsConnection* handle() const { return connection_.get(); }
  /// Beginning of the subjects that answers to this program come on, with a dot at its end:
  /// _INBOX.USER.RANDOM. where the user is known, so that permissions can tell users apart.
  [[nodiscard]] std::string make_inbox() const;
  /// JetStream on it.
  [[nodiscard]] jsCtx* jetstream() const { return jetstream_.get(); }
  /// Sends text without an answer. Throws NatsError.
  void publish(const std::string& subject, const std::string& text) const;
  /// How many servers are to hold each message: three where so many are known, else one.
  [[nodiscard]] std::int64_t replicas() const { return replicas_; }
  /// The streams of a fleet, made where there are none. Throws NatsError; not where nobody answers
  /// and they may be behind a leaf node, which lets their messages through and no questions.
  void require_streams(bool may_be_hidden = false) const;

 private:
  std::unique_ptr<natsConnection, Destroyer<&natsConnection_Destroy>> connection_;
  std::unique_ptr<jsCtx, Destroyer<&jsCtx_Destroy>> jetstream_;
  std::string inbox_prefix_;
  std::int64_t replicas_;
};

/// Pauses between attempts that fail: each twice as long as the one before, up to 30 s.
class Pauses {
 public:
  /// The next one.
  std::chrono::milliseconds next() {
    const std::chrono::milliseconds now = next_;
    next_ = std::min(2 * next_, std::chrono::milliseconds(30'000));
    return now;
  }
  /// Something has succeeded.
  void reset() { next_ = kFirst; }

 private:
  static constexpr std::chrono::milliseconds kFirst{250};
  std::chrono::milliseconds next_ = kFirst;
};

}  // namespace unimapper::nats_port
