#include "ports/lcm/encoding_thread.hpp"

#include <new>
#include <utility>

namespace unimapper::lcm_port {

namespace {

constexpr std::size_t kFirstBufferBytes = std::size_t{1} << 20U;

}  // namespace

EncodingThread::EncodingThread(const SessionId& session, const EncodingOptions& options, Take take)
    : session_(session),
      options_(options),
      take_(std::move(take)),
      queue_(options.room, options.keyframes),
      encoder_memory_(wire::KeyframeEncoder::required_bytes(options.room.cells)),
      buffer_(kFirstBufferBytes) {
  if (!queue_.ok()) throw std::bad_alloc();
  auto encoder = wire::KeyframeEncoder::create(options.room.cells, encoder_memory_.span());
  if (!encoder) throw std::bad_alloc();
  encoder_ = encoder.value();
  thread_ = std::thread([this] { run(); });
}

EncodingThread::~EncodingThread() {
  stopping_ = true;
  stop();
}

void EncodingThread::stop() noexcept {
  finishing_ = true;
  queued_.release();
  if (thread_.joinable()) thread_.join();
}

wire::HandedOver EncodingThread::hand_over(const KeyframeContent& keyframe) noexcept {
  ++handed_over_;
  wire::HandedOver result = queue_->push(keyframe, options_.drop_when_full);
  while (result == wire::HandedOver::kFull && !options_.drop_when_full && !failed_) {
    has_room_.acquire();
    result = queue_->push(keyframe, false);
  }
  if (result != wire::HandedOver::kQueued) ++dropped_;
  queued_.release();
  return result;
}

void EncodingThread::rethrow() {
  if (!failed_) return;
  const std::lock_guard lock(mutex_);
  std::rethrow_exception(failure_);
}

EncodingCounters EncodingThread::finish() {
  stop();
  rethrow();
  EncodingCounters counters = sums_;
  counters.handed_over = handed_over_;
  counters.dropped = dropped_;
  return counters;
}

void EncodingThread::run() {
  while (!stopping_) {
    const KeyframeContent* const keyframe = queue_->front();
    if (keyframe == nullptr) {
      // All that was handed over came before the word to finish.
      if (finishing_ && queue_->front() == nullptr) return;
      queued_.acquire();
      continue;
    }
    try {
      if (!failed_) encode(*keyframe);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
      failed_ = true;
    }
    queue_->pop();
    has_room_.release();
  }
}

void EncodingThread::encode(const KeyframeContent& keyframe) {
  wire::EncodeResult result = encoder_.encode(keyframe, session_, buffer_);
  if (result.error.code == ErrorCode::kBufferTooSmall) {
    buffer_.resize(2 * result.bytes);
    result = encoder_.encode(keyframe, session_, buffer_);
  }
  if (!result.error.ok()) {
    ++sums_.refused;
    return;
  }
  ++sums_.encoded;
  sums_.bytes += result.bytes;
  sums_.image_bytes += result.image_bytes;
  sums_.left_out += result.left_out;
  const auto bytes = std::span(buffer_).first(result.bytes);
  take_(
      {session_, keyframe.sequence, keyframe.scans.back().stamp_ns, {bytes.begin(), bytes.end()}});
}

}  // namespace unimapper::lcm_port
