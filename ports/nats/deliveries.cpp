#include "ports/nats/deliveries.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "ports/lcm/messages.hpp"
#include "ports/nats/subjects.hpp"

namespace unimapper::nats_port {

namespace {

/// Postponed messages come after 1, 2, 4, ... seconds, at last after 1024.
constexpr std::uint64_t kLongestPauseExponent = 10;
/// A session so often without a keyframe will never have one: 26 hours.
constexpr std::uint64_t kMaxDeliveries = 100;

class SourceDownlink final : public Downlink {
 public:
  SourceDownlink(std::unique_ptr<DeliverySource> source, std::size_t max_keyframe_bytes,
                 std::function<void(const std::string&)> report, wire::KeyframeStorage& storage)
      : max_keyframe_bytes_(max_keyframe_bytes),
        report_(std::move(report)),
        storage_(storage),
        source_(std::move(source)) {}

  void take(wire::Receiver& receiver) override {
    settle_sessions(receiver);
    if (!storage_.accepts()) return;  // what is postponed instead would come much later
    for (Delivery& delivery : source_->take()) {
      ++counters_.messages;
      const auto subject = parse_subject(delivery.subject);
      if (!subject) {
        drop(delivery, "it is about no keyframe");
      } else if (subject->sequence) {
        take_keyframe(receiver, *subject, delivery);
      } else {
        take_session(receiver, *subject, delivery);
      }
    }
  }
  [[nodiscard]] DownlinkCounters counters() const override {
    DownlinkCounters counters = counters_;
    counters.failures = source_->failures();
    return counters;
  }

  Taken keep(wire::ReceivedKeyframe&& keyframe) override {
    const wire::KeyframeName name{keyframe.record.session, keyframe.record.sequence};
    const Taken taken = storage_.keep(std::move(keyframe));
    if (taken == Taken::kWaiting) keyframes_.try_emplace(name);
    return taken;
  }
  void keep(const wire::SessionSummary& summary) override {
    storage_.keep(summary);
    auto handed_over = handed_over_.extract(summary.id);
    if (handed_over.empty()) return;
    // Says what an earlier one said, and more.
    const auto earlier = sessions_.find(summary.id);
    if (earlier != sessions_.end()) accept(earlier->second.reply);
    sessions_[summary.id] = std::move(handed_over.mapped());
  }
  void keep(wire::ReceivedSummary&& summary) override { storage_.keep(std::move(summary)); }
  void remove_summary(const wire::KeyframeName& name) override { storage_.remove_summary(name); }
  void keep(const wire::HealthMessage& health) override { storage_.keep(health); }
  wire::Committed commit_due(std::int64_t now_ns) override {
    return acknowledge_stored(storage_.commit_due(now_ns));
  }
  wire::Committed commit_all(std::int64_t now_ns) override {
    return acknowledge_stored(storage_.commit_all(now_ns));
  }
  std::optional<wire::StoredSession> find(const SessionId& id) override {
    return storage_.find(id);
  }
  [[nodiscard]] std::vector<wire::RobotUsage> usage() const override { return storage_.usage(); }
  [[nodiscard]] bool accepts() const override { return storage_.accepts(); }
  [[nodiscard]] bool is_durable() const override { return storage_.is_durable(); }

 private:
  void take_keyframe(wire::Receiver& receiver, const Subject& subject, Delivery& delivery) {
    const std::size_t bytes = delivery.bytes.size();
    if (bytes == 0 || bytes > max_keyframe_bytes_)
      return drop(delivery, "its size is no keyframe's");
    const wire::KeyframeName name{subject.session, *subject.sequence};
    wire::ChunkMessage whole;
    whole.session = name.session;
    whole.sequence = name.sequence;
    whole.count = 1;
    whole.total_bytes = static_cast<std::uint32_t>(bytes);
    whole.payload_crc32 = wire::crc32(delivery.bytes);
    whole.data = std::move(delivery.bytes);
    const wire::ReceiverCounters before = receiver.counters();
    receiver.receive(std::move(whole));
    const wire::ReceiverCounters after = receiver.counters();
    if (after.keyframes_damaged > before.keyframes_damaged) {
      return drop(delivery, "it is damaged, forged or not signed");
    }
    if (after.refused > before.refused) return postpone(delivery);
    const auto waiting = keyframes_.find(name);
    if (waiting == keyframes_.end()) return accept(delivery.reply);
    waiting->second = delivery.reply;
  }

  void take_session(wire::Receiver& receiver, const Subject& subject, Delivery& delivery) {
    const auto message = lcm_port::decode_session(delivery.bytes);
    if (!message || message->info.id != subject.session) {
      return drop(delivery, "it is no message of that session");
    }
    const wire::ReceiverCounters before = receiver.counters();
    receiver.receive(*message);
    const wire::ReceiverCounters after = receiver.counters();
    if (after.contradictory > before.contradictory) {
      return drop(delivery, "it gives a session another name");
    }
    if (after.refused > before.refused) return postpone(delivery);
    const auto earlier = handed_over_.find(subject.session);
    if (earlier != handed_over_.end()) accept(earlier->second.reply);
    handed_over_[subject.session] = std::move(delivery);
  }

  /// Sessions that the receiver was told of before it was advanced last, and that it did not hand
  /// on to be stored: they say nothing new, or have no keyframe yet.
  void settle_sessions(const wire::Receiver& receiver) {
    if (handed_over_.empty()) return;
    for (const wire::SessionProgress& session : receiver.progress()) {
      if (session.received + session.waiting + session.summaries == 0) continue;
      const auto handed_over = handed_over_.extract(session.info.id);
      if (!handed_over.empty()) accept(handed_over.mapped().reply);
    }
    for (const auto& [id, delivery] : std::exchange(handed_over_, {})) {
      if (delivery.number < kMaxDeliveries) {
        postpone(delivery);
      } else {
        drop(delivery, "its session has no keyframe");
      }
    }
  }

  wire::Committed acknowledge_stored(wire::Committed committed) {
    for (const wire::KeyframeName& name : committed.keyframes) {
      const auto waiting = keyframes_.extract(name);
      // Some came from robots.
      if (!waiting.empty() && !waiting.mapped().empty()) accept(waiting.mapped());
    }
    for (const wire::SessionSummary& summary : committed.sessions) {
      const auto waiting = sessions_.extract(summary.id);
      if (!waiting.empty()) accept(waiting.mapped().reply);
    }
    return committed;
  }

  void accept(const std::string& reply) {
    ++counters_.stored;
    source_->answer(reply, "+ACK");
  }
  void postpone(const Delivery& delivery) {
    ++counters_.postponed;
    const std::uint64_t exponent = std::min(delivery.number - 1, kLongestPauseExponent);
    const std::uint64_t pause_ns = 1'000'000'000ULL << exponent;
    source_->answer(delivery.reply, "-NAK {\"delay\": " + std::to_string(pause_ns) + "}");
  }
  void drop(const Delivery& delivery, const std::string& reason) {
    source_->answer(delivery.reply, "+TERM");
    if (counters_.dropped++ > 0) return;
    report_("warning: a message from " + delivery.subject +
            " was dropped, as others will be: " + reason);
  }

  std::size_t max_keyframe_bytes_;
  std::function<void(const std::string&)> report_;
  wire::KeyframeStorage& storage_;
  std::unique_ptr<DeliverySource> source_;
  DownlinkCounters counters_;
  std::map<wire::KeyframeName, std::string> keyframes_;  ///< not committed; where answers go
  std::map<SessionId, Delivery> handed_over_;            ///< to the receiver
  std::map<SessionId, Delivery> sessions_;               ///< to the storage, not committed
};

}  // namespace

std::unique_ptr<Downlink> make_downlink(std::unique_ptr<DeliverySource> source,
                                        std::size_t max_keyframe_bytes,
                                        std::function<void(const std::string&)> report,
                                        wire::KeyframeStorage& storage) {
  return std::make_unique<SourceDownlink>(std::move(source), max_keyframe_bytes, std::move(report),
                                          storage);
}

}  // namespace unimapper::nats_port
