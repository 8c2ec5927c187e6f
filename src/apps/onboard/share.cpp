#include "src/apps/onboard/share.hpp"

#include <stdexcept>
#include <utility>

namespace unimapper::apps {

namespace {

/// How long an announcer sleeps at most before it looks whether it is to end.
constexpr std::int64_t kLookNs = 100'000'000;

}  // namespace

TopicAnnouncer::TopicAnnouncer(const std::string& url, const std::string& share, const char* name,
                               const shared_memory::Writer& topic)
    : topic_(topic), doorbell_(url, share, name), announced_(topic.latest()) {
  thread_ = std::thread([this] { run(); });
}

TopicAnnouncer::~TopicAnnouncer() {
  stopping_ = true;
  thread_.join();
}

void TopicAnnouncer::run() {
  for (bool is_last = false; !is_last;) {
    // In this order: what was published before the end is seen.
    is_last = stopping_;
    const std::uint32_t latest =
        is_last ? topic_.latest() : topic_.wait_beyond(announced_, kLookNs);
    if (latest == announced_) continue;
    announced_ = latest;
    // One handle for all that came meanwhile. A lost one is made up for by the next.
    (void)doorbell_.ring(latest);
  }
}

Share::Share(const OnboardOptions& options, const PipelineConfig& config,
             const SessionId& session) {
  try {
    const shared_memory::Outcome opened = share_.open(options.share, config, session);
    if (!opened.ok) throw std::runtime_error("--share " + options.share + ": " + opened.message);
    announce(options);
  } catch (...) {
    announcers_.clear();
    share_.remove();
    throw;
  }
}

Share::~Share() {
  announcers_.clear();  // before the topics that they sleep on
  share_.remove();
}

void Share::announce(const OnboardOptions& options) {
  using shared_memory::ContentKind;
  if (options.share_doorbell.empty()) return;
  const std::pair<ContentKind, const char*> topics[] = {
      {ContentKind::kKeyframe, shared_memory::kKeyframeTopic},
      {ContentKind::kLabels, shared_memory::kLabelsTopic},
      {ContentKind::kHealth, shared_memory::kHealthTopic}};
  for (const auto& [kind, name] : topics) {
    const shared_memory::Writer* topic = share_.writer(kind);
    if (topic == nullptr) continue;
    announcers_.push_back(
        std::make_unique<TopicAnnouncer>(options.share_doorbell, options.share, name, *topic));
  }
}

std::unique_ptr<Share> open_share(const OnboardOptions& options, const PipelineConfig& config,
                                  const SessionId& session) {
  if (options.share.empty()) return nullptr;
  return std::make_unique<Share>(options, config, session);
}

}  // namespace unimapper::apps
