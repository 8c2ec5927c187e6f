// Sessions from LCM messages and event logs.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/receiver.hpp"

namespace unimapper::lcm_port {

using wire::Receiver;
using wire::ReceiverCounters;
using wire::ReceiverLimits;

/// Decodes one LCM message and hands it to `receiver`, which counts what is no message of ours. An
/// envelope (`authenticated_t`) is opened without a look at its code: that is a `DatagramGuard`'s.
void receive(Receiver& receiver, std::string_view channel, wire::Bytes data);

/// Feeds a whole event log to `receiver`; other channels are skipped. Returns what was wrong
/// with the file, each with its name and offset. Throws EventLogError if it cannot be opened.
std::vector<std::string> feed_event_log(Receiver& receiver, const std::filesystem::path& path);

/// The sessions of an event log and what was wrong with it.
struct ReceivedLog {
  std::vector<SessionData> sessions;  ///< what the log holds
  ReceiverCounters counters;          ///< what arrived and what was lost
  std::vector<std::string> faults;    ///< what was wrong with the file
};

/// Reads an event log, ours or lcm-logger's, complete or torn. Throws EventLogError if it cannot
/// be opened.
ReceivedLog read_event_log(const std::filesystem::path& path, const ReceiverLimits& limits = {});

}  // namespace unimapper::lcm_port
