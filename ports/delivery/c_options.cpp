#include "ports/delivery/c_options.hpp"

#include <cerrno>
#include <limits>

#include "ports/delivery/refusal.hpp"
#include "unimapper/wire/messages.hpp"

namespace unimapper::delivery {

namespace {

constexpr double kLowestHighRate = 1e3;  ///< bytes per second, as of `unimapper onboard`
constexpr double kLowestRate = 500.0;
constexpr double kHighestRate = 1e10;
constexpr std::uint32_t kMostQueued = 64;
constexpr std::uint64_t kFewestQueueBytes = 1'000;
constexpr std::uint64_t kMostQueueBytes = 1'000'000'000;
constexpr std::uint64_t kMostSpoolBytes = 1'000'000'000'000'000;

void require(bool holds, const std::string& text) {
  if (!holds) throw Refusal(EINVAL, text);
}

/// False for NaN.
bool is_within(double value, double low, double high) { return value >= low && value <= high; }

}  // namespace

void check(const um_delivery_options& options) {
  const std::string names = " must have 1 to 64 letters, digits, '.', '_' or '-', no '.' first";
  require(wire::is_session_name(text_of(options.name)), "name" + names);
  require(wire::is_session_name(text_of(options.sensor)), "sensor" + names);
  const bool has_spool = !text_of(options.spool).empty();
  require(has_spool || !text_of(options.url).empty(), "neither a url nor a spool: nothing is kept");
  require(options.datagram_bytes >= lcm_port::kSmallestDatagramBytes &&
              options.datagram_bytes <= lcm_port::kLargestDatagramBytes,
          "datagram_bytes must be 256 to 60000");
  require(is_within(options.bytes_per_second, kLowestHighRate, kHighestRate),
          "bytes_per_second must be 1e3 to 1e10");
  require(is_within(options.min_bytes_per_second, kLowestRate, options.bytes_per_second),
          "min_bytes_per_second must be 500 to bytes_per_second");
  require(options.unacknowledged_bytes > 0, "unacknowledged_bytes must be at least 1");
  require(!has_spool || (options.spool_bytes >= spool::kSmallestSpoolBytes &&
                         options.spool_bytes <= kMostSpoolBytes),
          "spool_bytes must be 1e6 to 1e15");
  require(options.queue_keyframes == 0 ||
              (options.queue_keyframes >= 2 && options.queue_keyframes <= kMostQueued),
          "queue_keyframes must be 0, or 2 to 64");
  require(options.queue_bytes >= kFewestQueueBytes && options.queue_bytes <= kMostQueueBytes,
          "queue_bytes must be 1e3 to 1e9");
}

DeliveryOptions to_cpp(const um_delivery_options& options) {
  const std::chrono::milliseconds finish_timeout(options.finish_timeout_ms);
  DeliveryOptions out;
  out.url = text_of(options.url);
  out.publisher.datagram_bytes = options.datagram_bytes;
  out.publisher.bytes_per_second = options.bytes_per_second;
  out.publisher.min_bytes_per_second = options.min_bytes_per_second;
  out.publisher.unacknowledged_bytes = options.unacknowledged_bytes;
  out.publisher.finish_timeout = finish_timeout;
  out.earlier_timeout = finish_timeout;
  out.finish_timeout = finish_timeout;
  out.spool = text_of(options.spool);
  out.spool_limits.bytes = options.spool_bytes;
  out.spool_limits.max_age = std::chrono::seconds(options.spool_max_age_s);
  if (options.report != nullptr) {
    out.spool_limits.report = [report = options.report,
                               context = options.report_context](const std::string& text) {
      report(context, ("spool " + text).c_str());
    };
  }
  return out;
}

}  // namespace unimapper::delivery

int um_delivery_options_init(um_delivery_options* options) {
  if (options == nullptr) return EINVAL;
  const unimapper::lcm_port::PublisherOptions publisher;
  const unimapper::spool::SpoolOptions spool;
  *options = {};
  options->sensor = "generic";
  options->url = "udpm://239.255.76.67:7667?ttl=0";
  options->datagram_bytes = publisher.datagram_bytes;
  options->finish_timeout_ms = static_cast<std::uint32_t>(publisher.finish_timeout.count());
  options->bytes_per_second = publisher.bytes_per_second;
  options->min_bytes_per_second = publisher.min_bytes_per_second;
  options->unacknowledged_bytes = publisher.unacknowledged_bytes;
  options->spool_bytes = spool.bytes;
  options->queue_bytes = 4'000'000;
  return 0;
}
