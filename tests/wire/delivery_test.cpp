// Tests of delivery: single rules, and a model of senders, link and base over seeded schedules.
#include "unimapper/wire/delivery.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <set>
#include <tuple>
#include <variant>
#include <vector>

#include "tests/wire/records.hpp"
#include "unimapper/wire/pieces.hpp"
#include "unimapper/wire/reassembly.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using wire_test::Random;

namespace {

constexpr std::int64_t kMs = 1000000;

StoredMessage described(StoredSequences& stored) {
  StoredMessage message;
  stored.describe(message);
  return message;
}

// ---------------------------------------------------------------------------------------------
// Model

constexpr std::int64_t kTickNs = 10 * kMs;
constexpr std::int64_t kResendAfterNs = 400 * kMs;

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
  Channel(Random& random, bool faulty)
      : random_(random),
        loss_(faulty ? random.below(50) : 0),
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
  explicit World(std::uint64_t seed)
      : random_(seed), to_base_(random_, true), to_robots_(random_, true) {
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

namespace {

/// Sends so many pieces; which keyframes they were of.
std::vector<std::uint32_t> send(Outbox& outbox, int pieces, std::int64_t now_ns = 0) {
  std::vector<std::uint32_t> sequences;
  for (int i = 0; i < pieces; ++i) {
    const auto piece = outbox.next();
    REQUIRE(piece);
    sequences.push_back(piece->sequence);
    outbox.sent(*piece, now_ns);
  }
  return sequences;
}

}  // namespace

TEST_CASE("keyframes go one after the other, the newest first, and every fourth is the oldest") {
  Outbox outbox(kResendAfterNs);
  for (std::uint32_t sequence = 0; sequence < 6; ++sequence) outbox.add(sequence, 2);
  CHECK(send(outbox, 12) == std::vector<std::uint32_t>{5, 5, 4, 4, 3, 3, 0, 0, 2, 2, 1, 1});
}

TEST_CASE("a keyframe that was begun is finished before a newer one") {
  Outbox outbox(kResendAfterNs);
  outbox.add(0, 3);
  CHECK(send(outbox, 1) == std::vector<std::uint32_t>{0});
  outbox.add(1, 2);
  CHECK(outbox.may_be_next(0));
  CHECK(outbox.may_be_next(1));
  CHECK(send(outbox, 4) == std::vector<std::uint32_t>{0, 0, 1, 1});
}

TEST_CASE("what a keyframe that was sent still lacks goes before others, if it is little") {
  Outbox outbox(kResendAfterNs);
  outbox.add(0, 8);
  (void)send(outbox, 8);
  outbox.add(1, 3);
  (void)send(outbox, 1);
  StoredMessage message;
  message.until = 10;
  message.incomplete = {{0, std::vector<bool>(8, false)}};
  message.incomplete[0].missing[3] = true;
  message.incomplete[0].missing[5] = true;
  SECTION("two pieces of eight") {
    (void)outbox.take(message, kResendAfterNs);
    CHECK(send(outbox, 4) == std::vector<std::uint32_t>{0, 0, 1, 1});
  }
  SECTION("three of eight wait for their turn") {
    message.incomplete[0].missing[6] = true;
    (void)outbox.take(message, kResendAfterNs);
    CHECK(send(outbox, 5) == std::vector<std::uint32_t>{1, 1, 0, 0, 0});
  }
}

TEST_CASE("summaries go first, the newest before all, and leave the others a quarter") {
  Outbox outbox(kResendAfterNs);
  for (std::uint32_t sequence = 0; sequence < 3; ++sequence) outbox.add(sequence, 10, 2);
  // Of the others the newest has its turn; its leading pieces are gone already.
  CHECK(send(outbox, 7) == std::vector<std::uint32_t>{2, 2, 1, 2, 1, 0, 0});
  CHECK(outbox.may_be_next(2));
  // One that comes while another is being sent interrupts it for its summary only.
  outbox.add(3, 10, 2);
  CHECK(send(outbox, 5) == std::vector<std::uint32_t>{2, 3, 3, 2, 2});
}

TEST_CASE("a summary that is lost is resent although its keyframe is still being sent") {
  Outbox outbox(kResendAfterNs);
  outbox.add(0, 100, 3);
  (void)send(outbox, 10);
  StoredMessage message;
  message.until = 10;
  message.incomplete = {{0, std::vector<bool>(100, true)}};
  message.incomplete[0].missing[1] = false;

  SECTION("only the pieces of it that are missing, and not before they may have arrived") {
    (void)outbox.take(message, kResendAfterNs - 1);
    CHECK(outbox.next()->index == 10);
    (void)outbox.take(message, kResendAfterNs);
    CHECK(outbox.next()->index == 0);
    (void)send(outbox, 1, kResendAfterNs);
    CHECK(outbox.next()->index == 2);
    (void)send(outbox, 1, kResendAfterNs);
    CHECK(outbox.next()->index == 10);
  }
  SECTION("not once it has arrived, whatever the base has dropped since") {
    for (int i = 0; i < 3; ++i) message.incomplete[0].missing[static_cast<std::size_t>(i)] = false;
    (void)outbox.take(message, 1);
    message.incomplete.clear();
    (void)outbox.take(message, 100 * kResendAfterNs);
    CHECK(outbox.next()->index == 10);
  }
  SECTION("as often as the base says that it lacks some, and then no more without a word") {
    std::int64_t now_ns = 0;
    for (int i = 0; i < 80; ++i) {
      (void)outbox.take(message, now_ns += kResendAfterNs);
      CHECK(outbox.next()->index == 0);
      (void)send(outbox, 2, now_ns);
    }
    message.incomplete.clear();
    (void)outbox.take(message, 1000 * kResendAfterNs);
    CHECK(outbox.next()->index == 10);
  }
  SECTION("a few times if the base says nothing of it") {
    message.incomplete.clear();
    std::int64_t now_ns = 0;
    int resent = 0;
    for (int i = 0; i < 1000; ++i) {
      (void)outbox.take(message, now_ns += kResendAfterNs / 4);
      while (outbox.next()->index < 3) {
        ++resent;
        outbox.sent(*outbox.next(), now_ns);
      }
    }
    CHECK(resent == 2 * 3);
  }
}

TEST_CASE("only what is missing is resent, and not what may be on its way still") {
  Outbox outbox(kResendAfterNs);
  outbox.add(0, 4);
  while (const auto piece = outbox.next()) outbox.sent(*piece, 0);
  CHECK(outbox.was_sent(0));
  StoredMessage message;
  message.until = 10;
  message.incomplete = {{0, {false, true, false, true}}};
  CHECK(outbox.take(message, kResendAfterNs - 1).empty());
  CHECK_FALSE(outbox.next());
  CHECK(outbox.take(message, kResendAfterNs).empty());
  std::vector<std::uint32_t> resent;
  while (const auto piece = outbox.next()) {
    resent.push_back(piece->index);
    outbox.sent(*piece, kResendAfterNs);
  }
  CHECK(resent == std::vector<std::uint32_t>{1, 3});

  SECTION("what the base means by other pieces is resent whole") {
    message.incomplete = {{0, {true}}};
    (void)outbox.take(message, 3 * kResendAfterNs);
    int pieces = 0;
    for (; outbox.next(); ++pieces) outbox.sent(*outbox.next(), 0);
    CHECK(pieces == 4);
  }
  SECTION("a message that speaks of other numbers says nothing") {
    message.first = 1;
    (void)outbox.take(message, 3 * kResendAfterNs);
    CHECK_FALSE(outbox.next());
    CHECK(outbox.size() == 1);
  }
  SECTION("what is stored is forgotten") {
    message.below = 1;
    CHECK(outbox.take(message, 0) == std::vector<std::uint32_t>{0});
    CHECK(outbox.size() == 0);
  }
}

TEST_CASE("what was sent at an earlier start is sent again only if the base misses it") {
  Outbox outbox(kResendAfterNs);
  outbox.add_sent(0, 2);
  outbox.add_sent(1, 3);
  CHECK_FALSE(outbox.next());
  CHECK(outbox.size() == 2);
  CHECK(outbox.was_sent(1));
  StoredMessage message;
  message.below = 1;
  message.first = 1;
  message.until = 10;
  message.incomplete = {{1, {false, true, false}}};
  CHECK(outbox.take(message, 0) == std::vector<std::uint32_t>{0});
  const auto piece = outbox.next();
  REQUIRE(piece);
  CHECK(piece->sequence == 1);
  CHECK(piece->index == 1);
  CHECK(outbox.is_due(1));
  CHECK(outbox.may_be_next(1));
  CHECK(outbox.sent(*piece, 0));
  CHECK_FALSE(outbox.is_due(1));
}
