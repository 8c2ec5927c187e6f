// Tests of delivery: a model of senders, link and base over seeded schedules.
#include "unimapper/wire/delivery.hpp"

#include "tests/test.hpp"
#include "tests/wire/records.hpp"
#include "unimapper/wire/pieces.hpp"
#include "unimapper/wire/reassembly.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using wire_test::Random;

namespace {

constexpr std::int64_t kTickNs = 10'000'000;
constexpr std::int64_t kResendAfterNs = 400'000'000;

StoredMessage described(StoredSequences& stored) {
  StoredMessage message;
  stored.describe(message);
  return message;
}

EncodedKeyframe keyframe_of(const SessionId& session, std::uint32_t sequence) {
  EncodedKeyframe keyframe{session, sequence, 0, {}};
  Random random(session.boot.low * 7919 + session.robot * 104729 + sequence);
  keyframe.bytes.resize(1 + random.below(200));
  for (std::uint8_t& byte : keyframe.bytes) byte = static_cast<std::uint8_t>(random.below(256));
  return keyframe;
}

std::vector<ChunkMessage> pieces_of(const SessionId& session, std::uint32_t sequence) {
  return cut_into_pieces(keyframe_of(session, sequence), 20);
}

/// Announces that a session is there.
struct Hello {
  SessionId session;
};
using Packet = std::variant<ChunkMessage, StoredMessage, Hello>;

/// A link that loses, delays, reorders, repeats and damages, and is down at times.
class Channel {
 public:
  explicit Channel(Random& random)
      : random_(random),
        loss_(random.below(50)),
        repeats_(random.below(30)),
        longest_delay_(1 + random.below(40)) {}

  void send(const Packet& packet, std::int64_t tick) {
    const int copies = random_.below(100) < repeats_ ? 2 : 1;
    for (int i = 0; i < copies; ++i) {
      if (is_down || random_.below(100) < loss_) continue;
      under_way_.emplace(tick + 1 + random_.below(longest_delay_), packet);
    }
  }
  std::vector<Packet> arrived(std::int64_t tick) {
    std::vector<Packet> packets;
    for (auto at = under_way_.begin(); at != under_way_.end() && at->first <= tick;) {
      packets.push_back(std::move(at->second));
      at = under_way_.erase(at);
    }
    return packets;
  }
  void heal() { loss_ = 0; }

  bool is_down = false;

 private:
  Random& random_;
  std::uint32_t loss_;
  std::uint32_t repeats_;
  std::uint32_t longest_delay_;
  std::multimap<std::int64_t, Packet> under_way_;
};

/// A start of a robot: what it has published survives in its spool, everything else does not.
struct Boot {
  SessionId session;
  std::uint32_t published = 0;
  std::set<std::uint32_t> acknowledged;
  Outbox outbox{kResendAfterNs};

  void publish() { add(published++); }
  void restart() {
    outbox = Outbox(kResendAfterNs);
    for (std::uint32_t i = 0; i < published; ++i) {
      if (!acknowledged.contains(i)) add(i);
    }
  }

 private:
  void add(std::uint32_t sequence) {
    const auto pieces = static_cast<std::uint32_t>(pieces_of(session, sequence).size());
    // Any number: it decides the order, and what is sent again early.
    outbox.add(sequence, pieces, static_cast<std::uint32_t>(session.boot.low + sequence) % 5);
  }
};

/// A base: what was committed survives, everything else does not.
struct Base {
  using Key = std::pair<SessionId, std::uint32_t>;
  std::map<Key, int> committed;  ///< how often
  bool wrong = false;            ///< something was stored that nobody published

  std::map<SessionId, StoredSequences> stored;
  std::set<SessionId> heard;
  std::set<Key> whole;  ///< to be committed
  Reassembly reassembly{ReceiverLimits{}};

  void take(ChunkMessage piece) {
    const Key key{piece.session, piece.sequence};
    heard.insert(key.first);
    if (stored[key.first].contains(key.second) || whole.contains(key)) return;
    const Reassembly::Result result = reassembly.add(std::move(piece), true);
    if (result.outcome != Reassembly::Outcome::kComplete) return;
    wrong = wrong || result.payload != keyframe_of(key.first, key.second).bytes;
    reassembly.forget(key.first, key.second);
    whole.insert(key);
  }
  void commit() {
    for (const Key& key : whole) {
      ++committed[key];
      stored[key.first].insert(key.second);
    }
    whole.clear();
  }
  void restart() {
    whole.clear();
    stored.clear();
    heard.clear();
    reassembly = Reassembly(ReceiverLimits{});
    for (const auto& [key, times] : committed) stored[key.first].insert(key.second);
  }
  std::vector<StoredMessage> answers() {
    std::vector<StoredMessage> messages;
    for (const SessionId& session : heard) {
      StoredMessage message = described(stored[session]);
      message.session = session;
      message.incomplete = reassembly.incomplete(session);
      messages.push_back(std::move(message));
    }
    heard.clear();
    return messages;
  }
};

class World {
 public:
  explicit World(std::uint64_t seed) : random_(seed), to_base_(random_), to_robots_(random_) {
    // Numbers of a robot that is restarted and of two robots under one name differ in the session.
    const std::uint32_t boots = 1 + random_.below(3);
    for (std::uint32_t i = 0; i < boots; ++i) boots_.emplace_back().session = {7, seed * 10 + i};
    per_tick_ = 1 + random_.below(6);
  }

  /// Faults for a while, then none until everything is delivered. False if that never happens.
  bool run() {
    for (; tick_ < 600; ++tick_) {
      if (random_.below(20) == 0) boots_[random_.below(count())].publish();
      if (random_.below(150) == 0) to_base_.is_down = !to_base_.is_down;
      if (random_.below(150) == 0) to_robots_.is_down = !to_robots_.is_down;
      if (random_.below(150) == 0) base.restart();
      if (random_.below(150) == 0) boots_[random_.below(count())].restart();
      if (random_.below(100) == 0) forge();
      step();
    }
    for (Channel* channel : {&to_base_, &to_robots_}) {
      channel->is_down = false;
      channel->heal();
    }
    for (const std::int64_t end = tick_ + 4000; tick_ < end && !is_delivered(); ++tick_) step();
    return is_delivered();
  }

  [[nodiscard]] std::size_t published() const {
    std::size_t sum = 0;
    for (const Boot& boot : boots_) sum += boot.published;
    return sum;
  }

  Base base;
  bool reported_falsely = false;  ///< acknowledged, but not committed

 private:
  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(boots_.size()); }

  [[nodiscard]] bool is_delivered() const {
    return std::all_of(boots_.begin(), boots_.end(),
                       [](const Boot& boot) { return boot.outbox.size() == 0; });
  }

  /// A piece with an overheard head and other bytes.
  void forge() {
    const Boot& boot = boots_[random_.below(count())];
    if (boot.published == 0) return;
    auto pieces = pieces_of(boot.session, boot.published - 1);
    ChunkMessage forged = pieces[random_.below(static_cast<std::uint32_t>(pieces.size()))];
    ++forged.data[0];
    base.take(std::move(forged));
  }

  void step() {
    for (Boot& boot : boots_) {
      if (tick_ % 100 == 0) to_base_.send(Hello{boot.session}, tick_);
      for (std::uint32_t i = 0; i < per_tick_; ++i) {
        const auto piece = boot.outbox.next();
        if (!piece) break;
        to_base_.send(pieces_of(boot.session, piece->sequence).at(piece->index), tick_);
        boot.outbox.sent(*piece, tick_ * kTickNs);
      }
    }
    for (Packet& packet : to_base_.arrived(tick_)) {
      if (auto* piece = std::get_if<ChunkMessage>(&packet)) base.take(std::move(*piece));
      if (const auto* hello = std::get_if<Hello>(&packet)) base.heard.insert(hello->session);
    }
    if (tick_ % 5 == 0) base.commit();
    if (tick_ % 20 == 0) {
      for (const StoredMessage& message : base.answers()) to_robots_.send(message, tick_);
    }
    for (const Packet& packet : to_robots_.arrived(tick_)) hear(std::get<StoredMessage>(packet));
  }

  void hear(const StoredMessage& message) {
    for (Boot& boot : boots_) {
      if (boot.session != message.session) continue;
      for (const std::uint32_t sequence : boot.outbox.take(message, tick_ * kTickNs)) {
        boot.acknowledged.insert(sequence);
        reported_falsely = reported_falsely || !base.committed.contains({boot.session, sequence});
      }
    }
  }

  Random random_;
  Channel to_base_;
  Channel to_robots_;
  std::vector<Boot> boots_;
  std::uint32_t per_tick_ = 1;
  std::int64_t tick_ = 0;
};

}  // namespace

TEST_CASE("nothing is lost, stored twice or reported falsely, whatever link, robot and base do") {
  std::size_t published = 0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    CAPTURE(seed);
    World world(seed);
    REQUIRE(world.run());
    CHECK_FALSE(world.reported_falsely);
    CHECK_FALSE(world.base.wrong);
    CHECK(world.base.committed.size() == world.published());
    for (const auto& [key, times] : world.base.committed) REQUIRE(times == 1);
    published += world.published();
  }
  CHECK(published > 20000);
}

TEST_CASE("runs of stored numbers agree with a set, and successive descriptions cover all") {
  Random random(3);
  StoredSequences stored;
  std::set<std::uint32_t> model;
  for (int i = 0; i < 3000; ++i) {
    const std::uint32_t sequence = random.below(2000);
    CHECK(stored.insert(sequence) == model.insert(sequence).second);
    if (i % 500 != 20 && i != 2999) continue;
    std::set<std::uint32_t> said;
    std::uint64_t covered = 0;
    do {
      const StoredMessage message = described(stored);
      REQUIRE(message.ranges.size() <= kMaxStoredRanges);
      for (std::uint64_t k = 0; k < message.below; ++k) said.insert(static_cast<std::uint32_t>(k));
      CHECK(message.first <= std::max(covered, message.below));
      for (const SequenceRange& range : message.ranges) {
        CHECK(range.begin >= message.first);
        for (std::uint64_t k = range.begin; k < range.end; ++k) {
          said.insert(static_cast<std::uint32_t>(k));
        }
      }
      covered = message.until;
    } while (covered < (std::uint64_t{1} << 32U));
    CHECK(said == model);
  }
}
