// Contents of a store, for `unimapper inspect`.
#include <cstdio>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "ports/store/store_reader.hpp"
#include "src/apps/base/base_options.hpp"
#include "src/apps/print.hpp"
#include "unimapper/wire/receiver.hpp"

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;

double duration_s(const store::SessionListing& session) {
  return static_cast<double>(session.last_stamp_ns - session.first_stamp_ns) * 1e-9;
}

/// Unix time as ISO 8601, UTC.
std::string time_text(std::int64_t seconds) {
  const std::time_t time = static_cast<std::time_t>(seconds);
  std::tm parts{};
  char text[32] = "";
  if (gmtime_r(&time, &parts) != nullptr) std::strftime(text, sizeof text, "%FT%TZ", &parts);
  return text;
}

Json describe(const store::SessionListing& session) {
  return {{"name", session.info.name},
          {"robot", session.info.id.robot},
          {"identity", wire::name_of(session.info.id)},
          {"sensor", session.info.sensor},
          {"first_stored", time_text(session.first_stored_s)},
          {"ended", session.ended},
          {"keyframes", session.keyframes},
          {"missing", session.missing()},
          {"summaries", session.summaries},
          {"dropped_by_robot", session.dropped_by_sender},
          {"bytes", session.bytes},
          {"duration_s", duration_s(session)},
          {"health_rows", session.health_rows}};
}

void print(const std::vector<store::SessionListing>& sessions) {
  std::uint64_t keyframes = 0;
  std::uint64_t bytes = 0;
  for (const store::SessionListing& session : sessions) {
    keyframes += session.keyframes;
    bytes += session.bytes;
  }
  print_to(stdout, "store        {} sessions, {} keyframes, {:.1f} MB\n", sessions.size(),
           keyframes, static_cast<double>(bytes) * 1e-6);
  for (const store::SessionListing& session : sessions) {
    const std::string of_summaries =
        session.summaries == 0 ? "" : " (summaries of " + std::to_string(session.summaries) + ")";
    print_to(
        stdout,
        "session      {}: robot {}, {}, {} keyframes ({:.1f} MB) in {:.1f} s, {} missing{}, {}, "
        "first stored {}\n",
        session.info.name, session.info.id.robot,
        session.info.sensor.empty() ? "unknown sensor" : session.info.sensor.c_str(),
        session.keyframes, static_cast<double>(session.bytes) * 1e-6, duration_s(session),
        session.missing(), of_summaries, session.ended ? "ended" : "open",
        time_text(session.first_stored_s));
  }
}

}  // namespace

void inspect_store(const std::filesystem::path& path, bool json, bool check) {
  store::StoreReader reader(path);
  const std::vector<store::SessionListing> sessions = reader.sessions();
  const std::vector<std::string> faults = check ? reader.check() : std::vector<std::string>();
  if (json) {
    Json all;
    all["sessions"] = Json::array();
    for (const store::SessionListing& session : sessions) {
      all["sessions"].push_back(describe(session));
    }
    if (check) all["faults"] = faults;
    std::cout << all.dump(2) << '\n';
  } else {
    print(sessions);
    std::fflush(stdout);
    for (const std::string& fault : faults) std::cout << "fault        " << fault << '\n';
    if (check && faults.empty()) std::cout << "check        every page and keyframe is sound\n";
  }
  if (!faults.empty()) {
    throw std::runtime_error(path.string() + ": " + std::to_string(faults.size()) + " faults");
  }
}

}  // namespace unimapper::apps
