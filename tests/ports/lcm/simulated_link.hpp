// Simulated link between a robot that sends pieces and a base that answers, with its own clock.
#pragma once

#include <deque>

#include "ports/lcm/pacing.hpp"
#include "tests/test.hpp"
#include "tests/wire/records.hpp"
#include "unimapper/wire/delivery.hpp"

namespace unimapper::lcm_port::lcm_test {

/// What a link does to datagrams.
struct LinkModel {
  double bytes_per_second = 32000.0;          ///< of the bottleneck
  double queue_bytes = 16000.0;               ///< before it; what does not fit is lost
  std::uint32_t loss_per_mille = 0;           ///< of the rest
  std::int64_t delay_ns = 10000000;           ///< each way
  std::uint32_t answer_loss_per_mille = 0;    ///< of the base's answers
  std::uint32_t answer_repeat_per_mille = 0;  ///< of those, come again up to 2 s later
};

/// A robot with an outbox of keyframes, a bucket and, if it adapts, a pacing; a base that has what
/// arrives stored at once and answers five times a second. Steps of 1 ms.
class SimulatedLink {
 public:
  static constexpr std::int64_t kStepNs = 1000000;
  static constexpr double kPieceBytes = 1300.0;

  SimulatedLink(const LinkModel& link, const PacingOptions& options, bool adapts,
                std::uint64_t seed = 1)
      : link_(link), adapts_(adapts), pacing(options), random_(seed) {}

  /// A keyframe of so many pieces is published, of which so many hold its summary.
  void publish(std::uint32_t pieces, std::uint32_t leading = 0) {
    outbox_.add(static_cast<std::uint32_t>(keyframes.size()), pieces, leading);
    keyframes.push_back({now_ns_, leading, std::nullopt, std::nullopt});
    missing_.emplace_back(pieces, true);
  }

  /// Runs until this time.
  void run(std::int64_t until_ns) {
    for (; now_ns_ < until_ns; now_ns_ += kStepNs) step();
  }

  [[nodiscard]] bool is_idle() const { return outbox_.size() == 0; }
  [[nodiscard]] std::int64_t now_ns() const { return now_ns_; }

  LinkModel link_;
  const bool adapts_;
  Pacing pacing;
  bool base_is_there = true;
  std::uint64_t window_bytes = 4000000;
  std::uint64_t base = 1;

  /// One that was published.
  struct Keyframe {
    std::int64_t published_ns = 0;
    std::uint32_t leading = 0;  ///< pieces
    std::optional<std::int64_t> summary_ns;
    std::optional<std::int64_t> whole_ns;  ///< when the base had it
  };
  std::vector<Keyframe> keyframes;

  std::uint64_t sent = 0;        ///< pieces
  std::uint64_t resent = 0;      ///< of which not for the first time
  std::uint64_t arrived = 0;     ///< pieces
  bool exceeded_window = false;  ///< a piece was sent beyond what the base had announced
  std::vector<double> rates;     ///< one each 100 ms

 private:
  struct Packet {
    std::int64_t at_ns = 0;
    bool is_probe = false;
    std::uint32_t number = 0;  ///< of the probe, or of the keyframe
    std::uint32_t index = 0;
  };
  struct Answer {
    std::vector<wire::ReceiptMessage> receipts;
    wire::StoredMessage stored;
  };

  void step() {
    send_pieces();
    if (now_ns_ % 200000000 == 0) put(100.0, {0, true, pacing.probe(now_ns_), 0});
    for (; !packets_.empty() && packets_.front().at_ns <= now_ns_; packets_.pop_front()) {
      if (base_is_there) arrive(packets_.front());
    }
    if (base_is_there && now_ns_ % 200000000 == 90000000) answer();
    while (!answers_.empty() && answers_.begin()->first <= now_ns_) {
      hear(answers_.begin()->second);
      answers_.erase(answers_.begin());
    }
    if (adapts_) pacing.advance(now_ns_);
    if (now_ns_ % 100000000 == 0) rates.push_back(pacing.rate());
  }

  void send_pieces() {
    const double burst = pacing.adapts() ? pacing.burst_bytes() : 64000.0;
    tokens_ = std::min(burst, tokens_ + pacing.rate() * 1e-9 * static_cast<double>(kStepNs));
    while (tokens_ >= kPieceBytes && (!adapts_ || pacing.has_room(kPieceBytes))) {
      const auto piece = outbox_.next();
      if (!piece) return;
      tokens_ -= kPieceBytes;
      pacing.sent(kPieceBytes);
      ++sent;
      resent += outbox_.was_sent(piece->sequence) ? 1 : 0;
      outbox_.sent(*piece, now_ns_);
      exceeded_window = exceeded_window ||
                        (adapts_ && pacing.window_bytes() &&
                         pacing.bytes_on_the_way() > static_cast<double>(*pacing.window_bytes()));
      put(kPieceBytes, {0, false, piece->sequence, piece->index});
    }
  }

  /// Into the bottleneck's queue, if it has room.
  void put(double bytes, Packet packet) {
    const auto now = static_cast<double>(now_ns_) * 1e-9;
    const double queued = std::max(0.0, free_at_s_ - now) * link_.bytes_per_second;
    const bool is_lost = random_.below(1000) < link_.loss_per_mille;
    if (is_lost || (queued > 0.0 && queued + bytes > link_.queue_bytes)) return;
    free_at_s_ = std::max(free_at_s_, now) + bytes / link_.bytes_per_second;
    packet.at_ns = static_cast<std::int64_t>(free_at_s_ * 1e9) + link_.delay_ns;
    packets_.push_back(packet);
  }

  void arrive(const Packet& packet) {
    if (packet.is_probe) {
      receipts_.push_back({{}, base, packet.number, now_ns_, 0, arrived, window_bytes});
      return;
    }
    ++arrived;
    auto& missing = missing_[packet.number];
    missing[packet.index] = false;
    Keyframe& keyframe = keyframes[packet.number];
    const auto is_here = [&](auto end) { return std::find(missing.begin(), end, true) == end; };
    if (!keyframe.summary_ns && is_here(missing.begin() + keyframe.leading)) {
      keyframe.summary_ns = now_ns_;
    }
    if (!keyframe.whole_ns && is_here(missing.end())) keyframe.whole_ns = now_ns_;
  }

  void answer() {
    Answer answer;
    answer.receipts.swap(receipts_);
    for (wire::ReceiptMessage& receipt : answer.receipts) {
      receipt.held_ns = now_ns_ - receipt.base_time_ns;
    }
    answer.stored.until = std::uint64_t{1} << 32U;
    for (std::uint32_t i = 0; i < missing_.size(); ++i) {
      const auto& missing = missing_[i];
      if (std::find(missing.begin(), missing.end(), true) == missing.end()) {
        answer.stored.ranges.push_back({i, i + 1ULL});
      } else if (std::find(missing.begin(), missing.end(), false) != missing.end()) {
        answer.stored.incomplete.push_back({i, missing});
      }
    }
    if (happens(link_.answer_loss_per_mille)) return;
    const std::int64_t at_ns = now_ns_ + link_.delay_ns;
    if (happens(link_.answer_repeat_per_mille)) {
      answers_.emplace(at_ns + random_.below(2000) * kStepNs, answer);
    }
    answers_.emplace(at_ns, std::move(answer));
  }

  /// What never happens draws no number, so that other schedules stay as they are.
  bool happens(std::uint32_t per_mille) { return per_mille > 0 && random_.below(1000) < per_mille; }

  void hear(const Answer& answer) {
    if (adapts_) {
      for (const wire::ReceiptMessage& receipt : answer.receipts) pacing.take(receipt, now_ns_);
      outbox_.set_resend_after(pacing.resend_after_ns());
    }
    (void)outbox_.take(answer.stored, now_ns_);
  }

  wire::wire_test::Random random_;
  wire::Outbox outbox_{400000000};
  std::vector<std::vector<bool>> missing_;  ///< at the base
  std::deque<Packet> packets_;
  std::multimap<std::int64_t, Answer> answers_;  ///< by the time of arrival
  std::vector<wire::ReceiptMessage> receipts_;
  std::int64_t now_ns_ = 0;
  double tokens_ = 0.0;
  double free_at_s_ = 0.0;
};

}  // namespace unimapper::lcm_port::lcm_test
