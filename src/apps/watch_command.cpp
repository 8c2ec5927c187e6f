// `unimapper watch`: the command line of src/apps/watch.
#include <CLI/CLI.hpp>
#include <memory>

#include "src/apps/commands.hpp"
#include "src/apps/watch/watch_options.hpp"

namespace unimapper::apps {

void register_watch(CLI::App& app) {
  auto options = std::make_shared<WatchOptions>();
  CLI::App* command =
      app.add_subcommand("watch", "Show what a robot on this computer shares in shared memory");
  command->add_option("NAME", options->name, "Name given to --share; none: the only one there is");
  command->add_option("--keyframes", options->keyframes, "Stop after so many; 0: go on")
      ->capture_default_str();
  command->add_option("--wait", options->wait_s, "Seconds to wait for a robot to appear")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 86400.0));
  command->add_flag("--oldest", options->from_oldest,
                    "Begin with the oldest keyframe in memory, not with the latest");
  command->footer(
      "Example:\n"
      "  unimapper onboard recordings/monday --out runs/monday --realtime --share robot7 &\n"
      "  unimapper watch robot7\n"
      "Ends with the robot. On a terminal: figures and a view from above; else a line a keyframe.");
  command->callback([options] { run_watch(*options); });
}

}  // namespace unimapper::apps
