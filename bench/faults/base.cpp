// Keyframes of a base and of a robot by names that can be compared: one line for each.
//   fault_base store FOLDER   of the store that `unimapper base` wrote
//   fault_base log FILE       of an event log, as a robot writes it
#include <sqlite3.h>

#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/faults/keyframes.hpp"
#include "ports/lcm/received_log.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace {

using namespace unimapper;

int read_log(const std::string& path) {
  for (const SessionData& session : lcm_port::read_event_log(path).sessions) {
    for (const KeyframeRecord& record : session.keyframes) {
      const std::string name = bench::name_of(record.sequence, wire::encode_keyframe(record));
      std::printf("published %s\n", name.c_str());
    }
  }
  return 0;
}

/// Reads the file's tables and nothing of the library that wrote them.
int read_store(const std::string& folder) {
  sqlite3* opened = nullptr;
  const int error =
      sqlite3_open_v2((folder + "/store.sqlite").c_str(), &opened, SQLITE_OPEN_READWRITE, nullptr);
  const std::unique_ptr<sqlite3, decltype(&sqlite3_close)> database(opened, &sqlite3_close);
  sqlite3_stmt* prepared = nullptr;
  const char* const query = "SELECT sequence, bytes FROM keyframes";
  if (error != SQLITE_OK ||
      sqlite3_prepare_v2(opened, query, -1, &prepared, nullptr) != SQLITE_OK) {
    throw std::runtime_error(folder + ": " + sqlite3_errmsg(opened));
  }
  const std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> rows(prepared,
                                                                        &sqlite3_finalize);
  int state = SQLITE_DONE;
  while ((state = sqlite3_step(prepared)) == SQLITE_ROW) {
    const auto* bytes = static_cast<const std::uint8_t*>(sqlite3_column_blob(prepared, 1));
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(prepared, 1));
    const auto sequence = static_cast<std::uint32_t>(sqlite3_column_int64(prepared, 0));
    std::printf("stored %s\n", bench::name_of(sequence, {bytes, size}).c_str());
  }
  if (state != SQLITE_DONE) throw std::runtime_error(folder + ": " + sqlite3_errmsg(opened));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  try {
    if (arguments.size() == 2 && arguments[0] == "log") return read_log(arguments[1]);
    if (arguments.size() == 2 && arguments[0] == "store") return read_store(arguments[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fault_base: %s\n", error.what());
    return 1;
  }
  std::fprintf(stderr, "usage: fault_base log FILE | fault_base store FOLDER\n");
  return 2;
}
