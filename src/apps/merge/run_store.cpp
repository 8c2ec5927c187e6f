#include "src/apps/merge/run_store.hpp"

#include <algorithm>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>

#include "ports/datasets/files.hpp"
#include "ports/lcm/received_log.hpp"
#include "ports/store/store_file.hpp"
#include "ports/store/transaction.hpp"

namespace unimapper::apps {
namespace {

namespace fs = std::filesystem;

/// Run folders in a folder that is none, for who named the folder above.
std::string runs_below(const fs::path& folder) {
  std::string text;
  std::error_code error;
  for (const fs::path& below : datasets::list_directories(folder)) {
    if (fs::exists(below / "keyframes.lcmlog", error)) text += " " + below.string();
  }
  return text.empty() ? text : "; runs in it:" + text;
}

/// The event log of a run folder, or the log itself.
fs::path log_of(const fs::path& run) {
  std::error_code error;
  if (!fs::exists(run, error)) throw std::runtime_error(run.string() + ": does not exist");
  if (!fs::is_directory(run, error)) return run;
  fs::path log = run / "keyframes.lcmlog";
  if (fs::exists(log, error)) return log;
  throw std::runtime_error(run.string() +
                           ": holds no keyframes.lcmlog; is it a folder that "
                           "`unimapper onboard --out` wrote?" +
                           runs_below(run));
}

/// The name of the folder that a path such as "runs/a/", "." or "runs/../runs/a" resolves to.
std::string folder_name(const fs::path& folder) {
  std::error_code error;
  const fs::path resolved = fs::canonical(folder, error);
  return (error ? folder : resolved).filename().string();
}

/// Sessions of a run that `unimapper onboard` cut are named RUN, RUN.2, ... after their folder.
void name_by_folder(const std::map<SessionId, store::ImportedSession>& sessions,
                    const std::string& folder, store::SessionImport& import) {
  std::string run = sessions.begin()->second.name;
  for (const auto& [id, session] : sessions) {
    if (session.name.size() < run.size()) run = session.name;
  }
  const auto is_other = [&](const auto& entry) { return !is_of_run(entry.second.name, run); };
  if (std::any_of(sessions.begin(), sessions.end(), is_other)) return;
  for (const auto& [id, session] : sessions) {
    import.name(id, folder + session.name.substr(run.size()));
  }
}

}  // namespace

bool is_of_run(const std::string& session, const std::string& run) {
  if (session == run) return true;
  if (!session.starts_with(run + ".") || session.size() == run.size() + 1) return false;
  return session.find_first_not_of("0123456789", run.size() + 1) == std::string::npos;
}

ImportedRun import_run(store::Database& database, const fs::path& run) {
  const fs::path log = log_of(run);
  store::SessionImport import(database);
  ImportedRun imported;
  {
    wire::Receiver receiver({}, import);
    for (const std::string& fault : lcm_port::feed_event_log(receiver, log)) {
      std::cerr << "unimapper: warning: " << fault << '\n';
    }
    receiver.store_all();
    imported.counters = receiver.counters();
    for (const wire::SessionProgress& session : receiver.progress()) {
      imported.damaged[session.info.id] = session.damaged;
    }
  }
  if (!import.trouble().empty()) throw store::StoreError(import.trouble());
  const auto sessions = import.sessions();
  if (sessions.empty()) {
    throw std::runtime_error(log.string() +
                             ": holds no keyframes of any session; if it is a recording, "
                             "`unimapper onboard` makes a run of it first");
  }
  if (log != run) name_by_folder(sessions, folder_name(run), import);
  for (const auto& [id, session] : import.sessions()) imported.sessions.push_back(session);
  return imported;
}

ImportedRun make_run_store(const fs::path& run, const fs::path& folder) try {
  fs::create_directory(folder);
  store::Database database = store::open_for_writing(folder);
  // A process that ends leaves nothing that is worth a log or waiting for the disk.
  database.run("PRAGMA journal_mode = MEMORY; PRAGMA synchronous = OFF");
  store::Transaction transaction(database);
  ImportedRun imported = import_run(database, run);
  transaction.commit();
  return imported;
} catch (const store::StoreError& error) {
  throw std::runtime_error("the copy of " + run.string() +
                           " that is read from cannot be written (disk full?): " + error.what());
}

}  // namespace unimapper::apps
