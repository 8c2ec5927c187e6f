// Sessions from run folders, event logs and stores.
#include <algorithm>
#include <iostream>
#include <set>
#include <stdexcept>
#include <tuple>

#include "ports/datasets/files.hpp"
#include "ports/store/store_file.hpp"
#include "ports/store/store_reader.hpp"
#include "src/apps/merge/merge_options.hpp"
#include "src/apps/merge/run_store.hpp"
#include "src/apps/merge/stored_contents.hpp"
#include "src/merge/sessions/keyframe_summaries.hpp"
#include "unimapper/merge/keyframe_level.hpp"

namespace unimapper::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxNameBytes = 100;

/// Names that were received become file names.
std::string file_safe(std::string name) {
  for (char& c : name) {
    const bool fine = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                      c == '-' || c == '_' || c == '.';
    if (!fine) c = '_';
  }
  if (name.size() > kMaxNameBytes) name.resize(kMaxNameBytes);
  if (name.empty() || name.front() == '.') name.insert(0, "session");
  return name;
}

void report_losses(const std::string& source, const wire::ReceiverCounters& counters,
                   const std::vector<SessionData>& sessions) {
  const auto warn = [&](std::uint64_t count, const char* what) {
    if (count > 0) std::cerr << "unimapper: warning: " << source << ": " << count << what << '\n';
  };
  warn(counters.malformed, " messages could not be decoded");
  warn(counters.refused, " messages were refused (too many sessions or too much data)");
  warn(counters.contradictory, " sessions changed their name or sensor on the way");
  warn(counters.keyframes_abandoned, " keyframes never became complete");
  for (const auto& session : sessions) report_missing(source, session);
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// The chosen sessions of a store, all if none is; `known`: the names of all that it has.
void read_store(const fs::path& path, const std::vector<std::string>& chosen,
                StoredContents& contents, std::vector<InputSession>& inputs,
                std::vector<std::string>& known) {
  store::StoreReader reader(path);
  std::vector<SessionData> sessions;
  for (const store::SessionListing& session : reader.sessions()) {
    known.push_back(session.info.name);
    if (!chosen.empty() && !contains(chosen, session.info.name)) continue;
    sessions.push_back(contents.read(path, reader, session));
  }
  if (sessions.empty() && chosen.empty()) {
    throw std::runtime_error(path.string() + ": has no session");
  }
  report_losses(path.string(), {}, sessions);
  for (SessionData& session : sessions) inputs.push_back({std::move(session), {}, 0});
}

/// The sessions of a run folder or an event log, from a store that is made of it in `folder`.
void read_run(const fs::path& run, const fs::path& folder, StoredContents& contents,
              std::vector<InputSession>& inputs) {
  const ImportedRun imported = make_run_store(run, folder);
  store::StoreReader reader(folder);
  std::vector<SessionData> sessions;
  for (const store::SessionListing& session : reader.sessions()) {
    SessionData& data = sessions.emplace_back(contents.read(folder, reader, session));
    const auto damaged = imported.damaged.find(data.info.id);
    if (damaged == imported.damaged.end()) continue;
    data.keyframes_damaged += damaged->second;
    data.keyframes_missing -= std::min(data.keyframes_missing, damaged->second);
  }
  report_losses(run.string(), imported.counters, sessions);
  const fs::path folder_of_run = fs::is_directory(run) ? run : fs::path();
  for (SessionData& session : sessions) inputs.push_back({std::move(session), folder_of_run, 0});
}

/// Throws if a session was asked for that no store has.
void require_known(const std::vector<std::string>& chosen, const std::vector<std::string>& known) {
  std::string names;
  for (const std::string& name : known) names += (names.empty() ? "" : ", ") + name;
  for (const std::string& name : chosen) {
    if (contains(known, name)) continue;
    throw std::runtime_error("--session names \"" + name + "\", but " +
                             (names.empty() ? "no store is given" : "the stores have: " + names));
  }
}

/// Whether two sessions of one identity have the same keyframes, as far as both have them.
bool is_same_run(const SessionData& a, const SessionData& b) {
  if (a.info.id != b.info.id) return false;
  const std::size_t common = std::min(a.keyframes.size(), b.keyframes.size());
  return std::equal(a.keyframes.begin(), a.keyframes.begin() + static_cast<std::ptrdiff_t>(common),
                    b.keyframes.begin(), [](const KeyframeRecord& x, const KeyframeRecord& y) {
                      return x.sequence == y.sequence && x.points_in == y.points_in &&
                             x.T_odometry_keyframe.translation == y.T_odometry_keyframe.translation;
                    });
}

/// A run that is given twice would be merged with itself: the one with more keyframes stays.
void drop_repeated(std::vector<InputSession>& inputs) {
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (std::size_t j = inputs.size(); --j > i;) {
      if (!is_same_run(inputs[i].data, inputs[j].data)) continue;
      std::cerr << "unimapper: warning: session " << inputs[i].data.info.name
                << " is given twice and counts once\n";
      if (inputs[j].data.keyframes.size() > inputs[i].data.keyframes.size()) {
        std::swap(inputs[i], inputs[j]);
      }
      inputs.erase(inputs.begin() + static_cast<std::ptrdiff_t>(j));
    }
  }
}

}  // namespace

void report_missing(const std::string& source, const SessionData& session) {
  const std::string name = "session " + session.info.name;
  if (session.keyframes_damaged > 0) {
    std::cerr << "unimapper: warning: " << source << ": " << name << " has "
              << session.keyframes_damaged << " damaged keyframes, which are left out\n";
  }
  if (session.keyframes_missing > 0) {
    std::cerr << "unimapper: warning: " << source << ": " << name << " lacks "
              << session.keyframes_missing << " keyframes";
    if (!session.summaries.empty()) {
      std::cerr << "; of " << session.summaries.size()
                << " the summary gives pose and loops, but nothing of the map";
    }
    std::cerr << '\n';
  }
  if (!session.complete) {
    std::cerr << "unimapper: warning: " << source << ": the end of " << name
              << " is missing; what is whole is used\n";
  }
}

std::vector<InputSession> gather_sessions(const MergeOptions& options, StoredContents& contents,
                                          const fs::path& scratch_parent) {
  std::vector<InputSession> inputs;
  std::vector<std::string> known;
  const datasets::TemporaryFolder scratch(scratch_parent);
  for (std::size_t i = 0; i < options.runs.size(); ++i) {
    if (store::is_store(options.runs[i])) {
      read_store(options.runs[i], options.chosen, contents, inputs, known);
    } else {
      read_run(options.runs[i], scratch.path() / std::to_string(i), contents, inputs);
    }
  }
  require_known(options.chosen, known);
  if (inputs.empty()) throw std::runtime_error("there is no session to merge");
  prepare_sessions(inputs);
  return inputs;
}

void prepare_sessions(std::vector<InputSession>& inputs) {
  for (auto& input : inputs) input.data.info.name = file_safe(input.data.info.name);
  // Independent of the order on the command line.
  std::sort(inputs.begin(), inputs.end(), [](const InputSession& a, const InputSession& b) {
    return std::tie(a.data.info.name, a.data.info.id, a.run) <
           std::tie(b.data.info.name, b.data.info.id, b.run);
  });
  drop_repeated(inputs);
  std::vector<SessionData*> sessions;
  for (auto& input : inputs) {
    (void)prepare_session(input.data);
    sessions.push_back(&input.data);
  }
  tell_names_apart(sessions);
}

std::size_t prepare_session(SessionData& session) {
  session.info.name = file_safe(session.info.name);
  merge::include_summaries(session);
  const std::size_t levelled = merge::level_keyframes(session);
  if (levelled > 0) {
    std::cerr << "unimapper: " << session.info.name << ": " << levelled
              << " keyframes levelled by others that know up\n";
  }
  return levelled;
}

void tell_names_apart(const std::vector<SessionData*>& sessions) {
  std::set<std::string> taken;
  for (SessionData* session : sessions) {
    const std::string name = session->info.name;
    for (int number = 2; !taken.insert(session->info.name).second; ++number) {
      session->info.name = name + "-" + std::to_string(number);
    }
  }
}

}  // namespace unimapper::apps
