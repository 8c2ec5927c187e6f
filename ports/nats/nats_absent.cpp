// Answers of a build without libnats.
#include "ports/nats/downlink.hpp"
#include "ports/nats/fleet_status.hpp"
#include "ports/nats/job_board.hpp"
#include "ports/nats/uplink.hpp"

namespace unimapper::nats_port {

namespace {

constexpr const char* kAbsent = "this build of unimapper lacks NATS (libnats, UNIMAPPER_NATS)";

}  // namespace

std::unique_ptr<Uplink> start_uplink(UplinkOptions, const store::StoreLock&) {
  throw NatsError(kAbsent);
}

std::unique_ptr<Downlink> start_downlink(DownlinkOptions, wire::KeyframeStorage&) {
  throw NatsError(kAbsent);
}

FleetStatus fleet_status(const Server&) { throw NatsError(kAbsent); }

std::unique_ptr<JobBoard> open_board(const Server&, const BoardNames&) { throw NatsError(kAbsent); }

std::unique_ptr<JobSource> open_source(const Server&, const std::string&,
                                       std::chrono::milliseconds) {
  throw NatsError(kAbsent);
}

}  // namespace unimapper::nats_port
