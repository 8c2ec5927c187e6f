// `unimapper worker`: the command line of src/apps/fleet.
#include <CLI/CLI.hpp>
#include <memory>

#include "src/apps/commands.hpp"
#include "src/apps/fleet/worker.hpp"
#include "src/apps/nats_options.hpp"

namespace unimapper::apps {

void register_worker(CLI::App& app) {
  auto options = std::make_shared<WorkerOptions>();
  CLI::App* command =
      app.add_subcommand("worker", "Verify loops for `unimapper map merge --workers` elsewhere");
  command
      ->add_option("--nats", options->server.url,
                   "nats://HOST:PORT, or tls://; several with commas")
      ->required();
  command->add_option("--disk", options->folder, "Folder for keyframes that were fetched");
  command->add_option("--disk-mb", options->disk_mb, "Megabytes of keyframes in it")
      ->capture_default_str()
      ->check(CLI::Range(1U, 100'000'000U));
  command->add_option("--memory", options->memory_mb, "Megabytes of keyframes and clouds in memory")
      ->capture_default_str()
      ->check(CLI::Range(1U, 1'000'000U));
  command->add_option("--threads", options->threads, "0: all processors")->capture_default_str();
  command->add_option("--http", options->http,
                      "Serve counters for Prometheus at HOST:PORT/metrics, e.g. 127.0.0.1:8081");
  add_nats_credentials(*command, options->server);
  command->footer(
      "Example:\n"
      "  unimapper worker --nats nats://127.0.0.1:4222 --disk keyframes\n"
      "Runs until SIGINT or SIGTERM.");
  command->callback([options] { run_worker(*options); });
}

}  // namespace unimapper::apps
