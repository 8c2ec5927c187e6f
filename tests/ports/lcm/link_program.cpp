// Publisher or listener process for the link test (link_test.sh).
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "ports/lcm/doorbell.hpp"
#include "ports/lcm/earlier_sessions.hpp"
#include "ports/lcm/live.hpp"
#include "ports/lcm/session_log.hpp"
#include "ports/shared_memory/reader.hpp"
#include "ports/spool/spool.hpp"
#include "tests/wire/stream.hpp"
#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/keyframe_codec.hpp"
#include "unimapper/wire/memory_storage.hpp"

using namespace unimapper;
using namespace unimapper::wire;
using namespace unimapper::lcm_port;

namespace {

/// Two datagrams of 60,000 bytes; no more, as emulated processors are slow.
constexpr std::uint32_t kCells = 13000;

volatile std::sig_atomic_t stop_requested = 0;

void request_stop(int /*signal*/) { stop_requested = 1; }

SessionInfo info_of(const std::string& name) {
  return {{static_cast<std::uint32_t>(name.size()),
           crc32(Bytes(reinterpret_cast<const std::uint8_t*>(name.data()), name.size()))},
          name,
          "os2-128"};
}

EncodedKeyframe keyframe_of(const SessionInfo& info, std::uint32_t sequence) {
  return wire_test::encode_for_sending(wire_test::keyframe_of(info.id, sequence, kCells));
}

/// One line per session: name, keyframes here, missing, damaged, and whether all are as sent.
void print(const std::vector<SessionData>& sessions) {
  for (const SessionData& session : sessions) {
    bool equal = true;
    for (const KeyframeRecord& record : session.keyframes) {
      equal = equal && encode_keyframe(record) == keyframe_of(session.info, record.sequence).bytes;
    }
    std::printf("%s keyframes=%zu missing=%llu damaged=%llu %s %s\n", session.info.name.c_str(),
                session.keyframes.size(),
                static_cast<unsigned long long>(session.keyframes_missing),
                static_cast<unsigned long long>(session.keyframes_damaged),
                session.complete ? "ended" : "open", equal ? "equal" : "DIFFERENT");
  }
}

// publish URL NAME KEYFRAMES DATAGRAM_BYTES PAUSE_MS [SPOOL]
int publish(const std::vector<std::string>& arguments) {
  const SessionInfo info = info_of(arguments[1]);
  PublisherOptions options;
  options.datagram_bytes = static_cast<std::uint32_t>(std::stoul(arguments[3]));
  std::unique_ptr<spool::Spool> spool;
  if (arguments.size() > 5) spool = std::make_unique<spool::Spool>(arguments[5]);
  Publisher publisher(info, open_link(arguments[0]), options, spool.get());
  const std::chrono::milliseconds pause(std::stol(arguments[4]));
  for (std::uint32_t i = 0; i < std::stoul(arguments[2]); ++i) {
    publisher.publish(keyframe_of(info, i));
    std::fprintf(stderr, "sent %u\n", i);
    std::this_thread::sleep_for(pause);
  }
  const PublisherCounters counters = publisher.finish();
  std::printf("sent=%llu dropped=%llu failures=%llu resent=%llu rate=%.0f\n",
              static_cast<unsigned long long>(counters.keyframes_sent),
              static_cast<unsigned long long>(counters.keyframes_dropped),
              static_cast<unsigned long long>(counters.send_failures),
              static_cast<unsigned long long>(counters.pieces_resent), counters.bytes_per_second);
  return 0;
}

// resume URL SPOOL
int resume(const std::vector<std::string>& arguments) {
  spool::Spool spool(arguments[1]);
  EarlierSessionsSender sender(spool, open_link(arguments[0]), {});
  const EarlierCounters counters = sender.finish(std::chrono::milliseconds(30000));
  std::printf("sessions=%llu delivered=%llu keyframes=%llu acknowledged=%llu lost=%llu\n",
              static_cast<unsigned long long>(counters.sessions),
              static_cast<unsigned long long>(counters.sessions_delivered),
              static_cast<unsigned long long>(counters.keyframes),
              static_cast<unsigned long long>(counters.keyframes_acknowledged),
              static_cast<unsigned long long>(counters.keyframes_lost));
  return 0;
}

/// What was received of each session.
std::vector<SessionData> take_sessions(const std::vector<SessionProgress>& progress,
                                       MemoryStorage& storage) {
  std::vector<SessionData> sessions;
  for (const SessionProgress& of : progress) {
    SessionData& session = sessions.emplace_back();
    session.info = of.info;
    session.complete = of.ended;
    session.keyframes_damaged = of.damaged;
    session.keyframes_missing = of.announced - std::min(of.announced, of.received + of.damaged);
    storage.take(session);
  }
  sort_and_name(sessions);
  return sessions;
}

// listen URL SESSIONS: until so many have ended, or until SIGTERM.
int listen_to(const std::vector<std::string>& arguments) {
  ListenOptions options;
  options.url = arguments[0];
  options.sessions_expected = std::stoul(arguments[1]);
  options.progress = [](const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); };
  std::vector<SessionProgress> progress;
  ReceiverCounters counters;
  options.status = [&](const std::vector<SessionProgress>& sessions, const ReceiverCounters& all) {
    progress = sessions;
    counters = all;
    for (const SessionProgress& session : sessions) {
      std::fprintf(stderr, "%s %llu/%llu\n", session.info.name.c_str(),
                   static_cast<unsigned long long>(session.received),
                   static_cast<unsigned long long>(session.announced));
    }
  };
  std::signal(SIGTERM, request_stop);
  options.stop = [] { return stop_requested != 0; };
  MemoryStorage storage(options.limits.max_stored_bytes);
  listen(options, storage);
  std::printf("end=%s malformed=%llu\n", stop_requested != 0 ? "stopped" : "sessions",
              static_cast<unsigned long long>(counters.malformed));
  print(take_sessions(progress, storage));
  return 0;
}

// consume URL SHARE MESSAGES TOPIC CONTENT: waits for handles alone.
int consume(const std::vector<std::string>& arguments) {
  const std::string& topic = arguments[3];
  shared_memory::ReaderOptions options;
  options.content = static_cast<std::uint32_t>(std::stoul(arguments[4], nullptr, 0));
  DoorbellListener listener(arguments[0], arguments[1], topic);
  shared_memory::Reader reader;
  std::fprintf(stderr, "waiting\n");
  unsigned long taken = 0;
  bool woken = false;
  while (taken < std::stoul(arguments[2]) && listener.wait(std::chrono::seconds(30))) {
    woken = true;
    if (!reader.is_open() && !reader.open(arguments[1], topic, options).ok) return 1;
    shared_memory::Sample sample;
    while (reader.take(sample) == shared_memory::Taken::kMessage) ++taken;
  }
  std::printf("taken=%lu missed=%u woken=%s\n", taken, reader.missed(), woken ? "yes" : "no");
  return 0;
}

// write PATH NAME KEYFRAMES
int write_log(const std::vector<std::string>& arguments) {
  const SessionInfo info = info_of(arguments[1]);
  SessionLogWriter writer(arguments[0], info);
  for (std::uint32_t i = 0; i < std::stoul(arguments[2]); ++i) writer.write(keyframe_of(info, i));
  writer.finish();
  return 0;
}

// read PATH
int read_log(const std::vector<std::string>& arguments) {
  const ReceivedLog log = read_event_log(arguments[0]);
  for (const std::string& fault : log.faults) std::printf("%s\n", fault.c_str());
  print(log.sessions);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::map<std::string, std::function<int(const std::vector<std::string>&)>> commands{
      {"publish", publish}, {"resume", resume},   {"listen", listen_to},
      {"consume", consume}, {"write", write_log}, {"read", read_log}};
  try {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    return commands.at(arguments.at(0))({arguments.begin() + 1, arguments.end()});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
