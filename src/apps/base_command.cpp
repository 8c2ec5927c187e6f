// `unimapper base`: the command line of src/apps/base.
#include <CLI/CLI.hpp>
#include <memory>

#include "src/apps/base/base_options.hpp"
#include "src/apps/commands.hpp"
#include "src/apps/nats_options.hpp"

namespace unimapper::apps {

namespace {

void add_fleet_options(CLI::App& command, const std::shared_ptr<BaseOptions>& options) {
  const auto add = [&command](const std::string& name, auto& value, const std::string& text) {
    return command.add_option(name, value, text)->group("Fleet (docs/fleet.md)");
  };
  add("--from", options->from,
      "Take in what sites have sent to a NATS server, nats://HOST:PORT or tls://HOST:PORT");
  CLI::Option* uplink =
      add("--uplink", options->uplink, "Send what is stored to a NATS server, for a centre");
  CLI::Option* site = add("--site", options->site, "Name of this site there")->needs(uplink);
  uplink->needs(site);
  command
      .add_flag("--uplink-all", options->uplinks_all,
                "Send also what was sent before: the server or the centre has lost it")
      ->needs(uplink)
      ->group("Fleet (docs/fleet.md)");
  add_nats_credentials(command, options->nats);
}

}  // namespace

void register_base(CLI::App& app) {
  auto options = std::make_shared<BaseOptions>();
  CLI::App* command =
      app.add_subcommand("base", "Receive sessions of any number of robots into a durable store");
  command
      ->add_option("--store", options->store,
                   "Folder of the store, made if absent; `unimapper merge` and `unimapper inspect` "
                   "read it, also meanwhile")
      ->required();
  CLI::Option* listen =
      command->add_option("--listen", options->listen,
                          "LCM's name of the network, e.g. udpm://239.255.76.67:7667?ttl=0");
  add_fleet_options(*command, options);
  command->add_option(
      "--http", options->http,
      "Serve the page of the store at HOST:PORT, e.g. 127.0.0.1:8080 (docs/page.md)");
  command->add_option(
      "--keys", options->keys,
      "Folder of robots' keys (unimapper keys): only what they sent and signed counts");
  command
      ->add_option("--sessions", options->sessions,
                   "End once so many sessions have ended; 0: run until SIGINT or SIGTERM")
      ->capture_default_str()
      ->check(CLI::Range(0, 256));
  CLI::Option* merges =
      command->add_flag("--merge", options->merges,
                        "Merge the sessions of the store while robots drive, and tell these where "
                        "they are in the map (docs/base.md)");
  command
      ->add_flag("--localise", options->localises,
                 "Localise robots in the store's map while they drive, and tell them where they "
                 "are (docs/localisation.md)")
      ->excludes(merges);
  command
      ->add_option("--localise-sessions", options->localised_sessions,
                   "Sessions localised at once; each takes the memory of the map once more")
      ->capture_default_str()
      ->check(CLI::Range(1, 64));
  command
      ->add_option(
          "--memory", options->memory_mb,
          "Megabytes for keyframes and clouds of --merge, and of each session of --localise")
      ->check(CLI::Range(1, 1'000'000));
  command
      ->add_option("--max-gb", options->max_gigabytes,
                   "Size of the store's database in GB; 0: as much as the disk holds")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
  command
      ->add_option("--robot-gb", options->robot_gigabytes,
                   "Keyframes stored of one robot, in GB; what is beyond is refused")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6))
      ->group("Quotas of a robot");
  command
      ->add_option("--robot-mb-per-second", options->robot_megabytes_per_second,
                   "New keyframes of one robot, in MB/s on average")
      ->capture_default_str()
      ->check(CLI::Range(0.001, 1e6))
      ->group("Quotas of a robot");
  command->add_option("--robot-sessions", options->robot_sessions, "Sessions stored of one robot")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000))
      ->group("Quotas of a robot");
  command
      ->add_option("--robot-incomplete", options->robot_incomplete,
                   "Incomplete keyframes held of one robot")
      ->capture_default_str()
      ->check(CLI::Range(1, 64))
      ->group("Quotas of a robot");
  command->footer(
      "Example:\n"
      "  unimapper base --store site --listen 'udpm://239.255.76.67:7667?ttl=0'\n"
      "  unimapper merge site --out map");
  command->callback([options, listen] {
    if (listen->empty() && options->from.empty()) throw CLI::RequiredError("--listen or --from");
    run_base(*options);
  });
}

}  // namespace unimapper::apps
