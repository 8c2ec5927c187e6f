// `unimapper localise`: the command line of src/apps/localise.
#include <CLI/CLI.hpp>
#include <memory>

#include "src/apps/commands.hpp"
#include "src/apps/localise/localise_options.hpp"

namespace unimapper::apps {

void register_localise(CLI::App& app) {
  auto given = std::make_shared<LocaliseOptions>();
  CLI::App* command =
      app.add_subcommand("localise", "Localise a run in a stored map, keyframe by keyframe");
  command->add_option("RUN", given->run, "Run folder of `unimapper onboard`, or an LCM event log")
      ->required();
  command->add_option("--session", given->session,
                      "Only that session, where the run or log holds several");
  command->add_option("--store", given->store, "Folder of the store; it is only read")->required();
  command->add_option("--epoch", given->epoch, "In the map of that epoch instead of the latest")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 62));
  command->add_option("--out", given->out, "Write the poses of localised keyframes as TUM");
  command->add_flag("--replace", given->replaces, "Overwrite that file");
  command->add_flag("--json", given->json, "The same as JSON");
  command->add_option("--threads", given->threads, "Threads to use; 0: all")
      ->check(CLI::Range(0, 256));
  command->footer("Example:\n  unimapper localise runs/tuesday --store site --out poses.tum");
  command->callback([given] { run_localise(*given); });
}

}  // namespace unimapper::apps
