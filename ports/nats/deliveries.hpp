// Messages of sites that wait for an answer, and what a centre does with them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ports/nats/downlink.hpp"

namespace unimapper::nats_port {

/// A message that waits for its answer.
struct Delivery {
  std::string subject;
  std::string reply;         ///< where its answer goes
  std::uint64_t number = 1;  ///< how often it was sent so far
  std::vector<std::uint8_t> bytes;
};

/// Where messages come from, and their answers go.
class DeliverySource {
 public:
  virtual ~DeliverySource() = default;

  /// What has come since the last call, in the order of the stream.
  virtual std::deque<Delivery> take() = 0;
  /// Answers what was delivered; an answer that is lost makes the message come again.
  virtual void answer(const std::string& reply, const std::string& text) = 0;
  /// Connections that ended with a reason.
  [[nodiscard]] virtual std::uint64_t failures() const = 0;
};

/// A downlink of what comes from a source. `storage` must outlive it.
std::unique_ptr<Downlink> make_downlink(std::unique_ptr<DeliverySource> source,
                                        std::size_t max_keyframe_bytes,
                                        std::function<void(const std::string&)> report,
                                        wire::KeyframeStorage& storage);

}  // namespace unimapper::nats_port
