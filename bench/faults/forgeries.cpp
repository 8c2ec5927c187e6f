#include "bench/faults/forgeries.hpp"

#include <map>
#include <optional>
#include <set>
#include <utility>

#include "bench/faults/keyframes.hpp"
#include "bench/faults/random.hpp"
#include "ports/lcm/sending.hpp"

namespace unimapper::bench {

namespace {

using lcm_port::kKeyframeChannel;
using lcm_port::kSessionChannel;
using lcm_port::kStoredChannel;
using wire::Bytes;

/// Robots that no real one is.
constexpr std::uint32_t kForgedRobot = 0xF0000000U;

bool is_forged(const SessionId& id) { return id.robot >= kForgedRobot; }

SessionId forged_session(Random& random) {
  return {kForgedRobot + random.below(1000), random.bits()};
}

/// The head of an overheard keyframe with other content in its last piece, before the real one.
class BadPieces : public Forgery {
 public:
  using Forgery::Forgery;
  void overhear(std::string_view channel, Bytes message) override {
    if (channel != kKeyframeChannel) return;
    auto piece = lcm_port::decode_chunk(message);
    if (!piece || piece->index != 0 || piece->count < 2) return;
    const auto size = piece->data.size();
    piece->index = piece->count - 1;
    piece->data.assign(piece->total_bytes - (piece->count - 1) * size, 0xAA);
    send_(channel, lcm_port::encode(*piece));
  }
  void act(double /*now_s*/, std::size_t /*bytes*/) override {}
};

/// 200 sessions of robots that are none, once, before any robot starts.
class Sessions : public Forgery {
 public:
  using Forgery::Forgery;
  void overhear(std::string_view /*channel*/, Bytes /*message*/) override {}
  void act(double /*now_s*/, std::size_t /*bytes*/) override {
    constexpr int kSessions = 200;
    for (; sent_ < kSessions; ++sent_) {
      wire::SessionMessage message;
      message.info = {forged_session(random_), "forged" + std::to_string(sent_), "vlp-16"};
      send_(kSessionChannel, lcm_port::encode(message));
    }
  }

 private:
  int sent_ = 0;
  Random random_{1};
};

/// What an overheard session message becomes. Its own are known by what they say.
class AlteredSession : public Forgery {
 public:
  AlteredSession(Send send, double period_s) : Forgery(std::move(send)), period_s_(period_s) {}
  void overhear(std::string_view channel, Bytes message) override {
    if (channel != kSessionChannel) return;
    auto session = lcm_port::decode_session(message);
    if (!session || !is_real(*session)) return;
    const bool first = latest_.empty();
    latest_ = {*session};
    if (first) forge();
  }
  void act(double now_s, std::size_t /*bytes*/) override {
    if (period_s_ <= 0.0 || latest_.empty() || now_s < next_s_) return;
    next_s_ = now_s + period_s_;
    forge();
  }

 protected:
  [[nodiscard]] virtual bool is_real(const wire::SessionMessage& message) const = 0;
  virtual void alter(wire::SessionMessage& message) const = 0;

 private:
  void forge() {
    wire::SessionMessage forged = latest_.front();
    alter(forged);
    send_(kSessionChannel, lcm_port::encode(forged));
  }

  double period_s_;
  double next_s_ = 0.0;
  std::vector<wire::SessionMessage> latest_;
};

/// The end of a session that goes on.
class Ended : public AlteredSession {
 public:
  using AlteredSession::AlteredSession;

 protected:
  [[nodiscard]] bool is_real(const wire::SessionMessage& message) const override {
    return message.state != wire::SessionState::kEnded;
  }
  void alter(wire::SessionMessage& message) const override {
    message.state = wire::SessionState::kEnded;
  }
};

/// A start of the session under another name.
class Renamed : public AlteredSession {
 public:
  using AlteredSession::AlteredSession;

 protected:
  [[nodiscard]] bool is_real(const wire::SessionMessage& message) const override {
    return message.info.name != kName;
  }
  void alter(wire::SessionMessage& message) const override {
    message.state = wire::SessionState::kStarted;
    message.info.name = kName;
  }

 private:
  static constexpr const char* kName = "forged";
};

/// Keyframes of an overheard session, 500 m away, before the robot has made them.
class Shifted : public Forgery {
 public:
  using Forgery::Forgery;
  void overhear(std::string_view channel, Bytes message) override {
    if (channel != kSessionChannel || session_) return;
    const auto heard = lcm_port::decode_session(message);
    if (!heard || is_forged(heard->info.id)) return;
    session_ = heard->info.id;
  }
  void act(double /*now_s*/, std::size_t bytes) override {
    constexpr std::uint32_t kKeyframes = 60;
    constexpr std::uint32_t kBytes = 20000;
    std::size_t sent = 0;
    while (session_ && next_ < kKeyframes && sent < bytes) {
      KeyframeSize size;
      size.bytes = kBytes;
      size.shift_m = 500.0;
      const wire::EncodedKeyframe keyframe = generate_keyframe(*session_, next_++, 99, size);
      for (const auto& piece :
           lcm_port::cut_into_messages(keyframe, lcm_port::kLargestDatagramBytes)) {
        sent += piece.size();
        send_(kKeyframeChannel, piece);
      }
    }
  }

 private:
  std::optional<SessionId> session_;
  std::uint32_t next_ = 0;
};

/// All that was overheard in the first seconds, over and over.
class Replay : public Forgery {
 public:
  using Forgery::Forgery;
  [[nodiscard]] bool is_of_datagrams() const override { return true; }
  void overhear(std::string_view channel, Bytes message) override {
    if (replaying_ || heard_bytes_ > kMaxBytes) return;
    heard_bytes_ += message.size();
    heard_.emplace_back(std::string(channel),
                        std::vector<std::uint8_t>(message.begin(), message.end()));
  }
  void act(double now_s, std::size_t bytes) override {
    if (!heard_.empty() && start_s_ < 0.0) start_s_ = now_s;
    replaying_ = replaying_ || (start_s_ >= 0.0 && now_s - start_s_ > kListens_s);
    if (!replaying_) return;
    for (std::size_t sent = 0; sent < bytes;) {
      const auto& [channel, message] = heard_[next_++ % heard_.size()];
      send_(channel, message);
      sent += message.size();
    }
  }

 private:
  static constexpr double kListens_s = 2.0;
  static constexpr std::size_t kMaxBytes = 64U << 20U;
  std::vector<std::pair<std::string, std::vector<std::uint8_t>>> heard_;
  std::size_t heard_bytes_ = 0;
  std::size_t next_ = 0;
  double start_s_ = -1.0;
  bool replaying_ = false;
};

/// Pieces of keyframes that never become whole, half of them of overheard sessions.
class Pieces : public Forgery {
 public:
  using Forgery::Forgery;
  void overhear(std::string_view channel, Bytes message) override {
    if (channel != kSessionChannel || victim_) return;
    if (const auto heard = lcm_port::decode_session(message)) victim_ = heard->info.id;
  }
  void act(double /*now_s*/, std::size_t bytes) override {
    constexpr std::uint32_t kPieceBytes = 8000;
    for (std::size_t sent = 0; sent < bytes; sent += kPieceBytes) {
      wire::ChunkMessage piece;
      piece.session = victim_ && random_.below(2) == 0 ? *victim_ : forged_session(random_);
      piece.sequence = random_.below(200);
      piece.count = 2 + random_.below(1000);
      piece.total_bytes = piece.count * kPieceBytes;
      piece.index = random_.below(piece.count);
      piece.payload_crc32 = static_cast<std::uint32_t>(random_.bits());
      piece.data.assign(kPieceBytes, static_cast<std::uint8_t>(random_.below(256)));
      send_(kKeyframeChannel, lcm_port::encode(piece));
    }
  }

 private:
  std::optional<SessionId> victim_;
  Random random_{2};
};

/// Valid keyframes with as many images as one may have, of ten robots that are none.
class Keyframes : public Forgery {
 public:
  using Forgery::Forgery;
  void overhear(std::string_view /*channel*/, Bytes /*message*/) override {}
  void act(double /*now_s*/, std::size_t bytes) override {
    constexpr std::uint64_t kRobots = 10;
    for (std::size_t sent = 0; sent < bytes; ++next_) {
      KeyframeSize size;
      size.bytes = 0;
      size.images = 32;
      size.image_rows = 80;
      const SessionId session{kForgedRobot + static_cast<std::uint32_t>(next_ % kRobots), 1};
      const auto sequence = static_cast<std::uint32_t>(next_ / kRobots);
      const wire::EncodedKeyframe keyframe = generate_keyframe(session, sequence, 98, size);
      for (const auto& piece :
           lcm_port::cut_into_messages(keyframe, lcm_port::kLargestDatagramBytes)) {
        sent += piece.size();
        send_(kKeyframeChannel, piece);
      }
    }
  }

 private:
  std::uint64_t next_ = 0;
};

/// "All is stored", of every session that is overheard, ten times a second.
class Acknowledgements : public Forgery {
 public:
  using Forgery::Forgery;
  void overhear(std::string_view channel, Bytes message) override {
    if (channel != kSessionChannel) return;
    if (const auto heard = lcm_port::decode_session(message)) sessions_.insert(heard->info.id);
  }
  void act(double now_s, std::size_t /*bytes*/) override {
    if (now_s < next_s_) return;
    next_s_ = now_s + 0.1;
    for (const SessionId& session : sessions_) {
      wire::StoredMessage message;
      message.session = session;
      message.below = message.first = message.until = std::uint64_t{1} << 32U;
      send_(kStoredChannel, lcm_port::encode(message));
    }
  }

 private:
  std::set<SessionId> sessions_;
  double next_s_ = 0.0;
};

template <typename Kind, typename... Arguments>
auto maker(Arguments... arguments) {
  return [arguments...](Forgery::Send send) -> std::unique_ptr<Forgery> {
    return std::make_unique<Kind>(std::move(send), arguments...);
  };
}

using Maker = std::function<std::unique_ptr<Forgery>(Forgery::Send)>;

const std::map<std::string, Maker>& makers() {
  constexpr double kOnce = 0.0;
  constexpr double kAgain_s = 0.1;
  static const std::map<std::string, Maker> kMakers{
      {"bad-pieces", maker<BadPieces>()},    {"sessions", maker<Sessions>()},
      {"ended", maker<Ended>(kOnce)},        {"ended-again", maker<Ended>(kAgain_s)},
      {"renamed", maker<Renamed>(kAgain_s)}, {"shifted", maker<Shifted>()},
      {"replay", maker<Replay>()},           {"pieces", maker<Pieces>()},
      {"keyframes", maker<Keyframes>()},     {"acknowledgements", maker<Acknowledgements>()}};
  return kMakers;
}

}  // namespace

std::unique_ptr<Forgery> make_forgery(const std::string& name, Forgery::Send send) {
  const auto found = makers().find(name);
  return found == makers().end() ? nullptr : found->second(std::move(send));
}

std::vector<std::string> forgery_names() {
  std::vector<std::string> names;
  for (const auto& [name, maker] : makers()) names.push_back(name);
  return names;
}

}  // namespace unimapper::bench
