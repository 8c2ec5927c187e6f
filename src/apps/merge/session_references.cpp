#include "src/apps/merge/session_references.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <iostream>
#include <stdexcept>

#include "src/apps/evaluate/evaluate.hpp"
#include "src/apps/merge/run_store.hpp"
#include "src/apps/truth.hpp"

namespace unimapper::apps {
namespace {

/// "runs/a" and "runs/a/" are both called "a".
std::string folder_name(const std::filesystem::path& folder) {
  return folder.has_filename() ? folder.filename().string()
                               : folder.parent_path().filename().string();
}

std::pair<std::string, std::filesystem::path> parse_truth(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw CLI::ValidationError("--truth", "\"" + text + "\" is not of the form SESSION=DATASET");
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

/// Whether a dataset that is named for a run is the truth of a session.
bool is_truth_of(const ReferenceOptions& options, const std::string& run,
                 const std::string& session) {
  const bool is_named = std::any_of(options.truths.begin(), options.truths.end(),
                                    [&](const auto& truth) { return truth.first == session; });
  return is_named ? session == run : is_of_run(session, run);
}

}  // namespace

void add_reference_options(CLI::App& command, ReferenceOptions& options) {
  command
      .add_option_function<std::vector<std::string>>(
          "--truth",
          [&options](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) options.truths.push_back(parse_truth(text));
          },
          "SESSION=DATASET with ground truth, for the report's errors")
      ->expected(1, -1);
  command
      .add_option("--stats", options.stats,
                  "Run folders of sessions that came over the air, for the report's latency and "
                  "removal scores")
      ->expected(1, -1);
}

std::vector<SessionReference> gather_references(const ReferenceOptions& options,
                                                const std::vector<SessionData>& sessions,
                                                const std::vector<std::filesystem::path>& runs) {
  std::vector<SessionReference> references(sessions.size());
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    references[s].run = runs[s];
    for (const auto& folder : options.stats) {
      if (references[s].run.empty() && folder_name(folder) == sessions[s].info.name) {
        references[s].run = folder;
      }
    }
  }
  for (const auto& [name, dataset] : options.truths) {
    const std::string& wanted = name;
    const auto found = std::find_if(sessions.begin(), sessions.end(),
                                    [&](const SessionData& s) { return s.info.name == wanted; });
    if (found == sessions.end()) {
      std::string known;
      for (const auto& session : sessions) {
        if (!known.empty()) known += ", ";
        known += session.info.name;
      }
      throw std::runtime_error("--truth names session \"" + name + "\", but there are: " + known);
    }
    for (std::size_t s = 0; s < sessions.size(); ++s) {
      if (is_truth_of(options, wanted, sessions[s].info.name))
        references[s].truth = read_truth(dataset);
    }
    SessionReference& of = references[static_cast<std::size_t>(found - sessions.begin())];
    if (of.run.empty() || !std::filesystem::is_directory(of.run / "labels")) continue;
    try {
      of.removal = score_run(dataset, of.run);
    } catch (const std::exception& error) {
      // The map does not depend on scores.
      std::cerr << "unimapper: note: no removal score for " << name << ": " << error.what() << '\n';
    }
  }
  return references;
}

}  // namespace unimapper::apps
