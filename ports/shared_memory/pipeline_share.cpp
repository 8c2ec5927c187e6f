#include "ports/shared_memory/pipeline_share.hpp"

#include <algorithm>
#include <cerrno>

namespace unimapper::shared_memory {

namespace {

// A keyframe's scans are labelled at once: consumers of labels find them all.
constexpr std::uint32_t kLabelsHistory = KeyframeConfig::kMaxScans;

}  // namespace

Outcome PipelineShare::open(std::string_view share, const PipelineConfig& config,
                            const SessionId& session,
                            const PipelineShareOptions& options) noexcept {
  const std::uint64_t keyframe_bytes = max_keyframe_bytes(config);
  const std::uint64_t labels_bytes = max_labels_bytes(config);
  if (std::max(keyframe_bytes, labels_bytes) > kMaxChunkBytes) {
    return {false, E2BIG, "a keyframe of this configuration may be larger than 256 MiB"};
  }
  session_ = session;
  health_ = {};
  has_labels_ = options.labels;
  WriterOptions writer;
  writer.consumers = options.consumers;
  writer.audience = options.audience;

  writer.content = content_of(ContentKind::kKeyframe);
  writer.message_bytes = static_cast<std::uint32_t>(keyframe_bytes);
  writer.leases = 1;
  Outcome outcome = keyframes_.open(share, kKeyframeTopic, writer);
  if (!outcome.ok) return outcome;

  writer.content = content_of(ContentKind::kHealth);
  writer.message_bytes = sizeof(SharedHealth);
  outcome = healths_.open(share, kHealthTopic, writer);
  if (!outcome.ok || !has_labels_) return outcome;

  writer.content = content_of(ContentKind::kLabels);
  writer.message_bytes = static_cast<std::uint32_t>(labels_bytes);
  writer.leases = 2;
  writer.history = kLabelsHistory;
  return labels_.open(share, kLabelsTopic, writer);
}

void PipelineShare::after_scan(const Pipeline& pipeline, const ScanResult& result) noexcept {
  health_.add_scan(result.error);
  after_flush(pipeline, result);
}

void PipelineShare::after_flush(const Pipeline& pipeline, const ScanResult& result) noexcept {
  if (result.keyframe_ready && has_labels_) share_labels(pipeline);
  if (result.keyframe_finished) share_finished(pipeline);
}

void PipelineShare::count(std::uint32_t published) noexcept {
  if (published == 0) health_.add_failure();
}

void PipelineShare::share_labels(const Pipeline& pipeline) noexcept {
  const KeyframeView& keyframe = pipeline.keyframe();
  for (std::size_t i = 0; i < keyframe.scans.size(); ++i) {
    const std::span<std::byte> memory = labels_.loan();
    const std::size_t labels = pipeline.labels(i, label_memory(memory));
    const std::size_t bytes =
        finish_labels(keyframe.scans[i], keyframe.sequence, session_, labels, memory);
    count(bytes == 0 ? 0 : labels_.publish(bytes, keyframe.scans[i].stamp_ns));
  }
}

void PipelineShare::share_finished(const Pipeline& pipeline) noexcept {
  const KeyframeView& keyframe = pipeline.finished_keyframe();
  const std::int64_t stamp_ns = keyframe.scans.empty() ? 0 : keyframe.scans.back().stamp_ns;
  const std::size_t bytes = write_keyframe(keyframe, session_, keyframes_.loan());
  count(bytes == 0 ? 0 : keyframes_.publish(bytes, stamp_ns));
  health_.add_keyframe(keyframe);
  const std::size_t health_bytes = health_.write(session_, healths_.loan());
  count(health_bytes == 0 ? 0 : healths_.publish(health_bytes, stamp_ns));
}

const Writer* PipelineShare::writer(ContentKind topic) const noexcept {
  const Writer* found = nullptr;
  if (topic == ContentKind::kKeyframe) found = &keyframes_;
  if (topic == ContentKind::kLabels) found = &labels_;
  if (topic == ContentKind::kHealth) found = &healths_;
  return found != nullptr && found->is_open() ? found : nullptr;
}

void PipelineShare::reclaim() noexcept {
  for (Writer* writer : {&keyframes_, &labels_, &healths_}) (void)writer->reclaim();
}

void PipelineShare::remove() noexcept {
  for (Writer* writer : {&keyframes_, &labels_, &healths_}) writer->remove();
}

}  // namespace unimapper::shared_memory
