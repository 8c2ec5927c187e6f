// `unimapper view`: the command line of src/apps/view.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>

#include "src/apps/commands.hpp"
#include "src/apps/view/view_options.hpp"

namespace unimapper::apps {

void register_view(CLI::App& app) {
  auto options = std::make_shared<ViewOptions>();
  CLI::App* command =
      app.add_subcommand("view", "Show a map, or a store while it grows, in a browser");
  command->add_option("MAP", options->map, "A store, or a folder with a map")->required();
  command
      ->add_option("--http", options->http,
                   "HOST:PORT to listen at; port 0: any that is free. Other machines reach only "
                   "addresses that are theirs to reach: the default is this machine alone")
      ->capture_default_str();
  command->add_option("--epoch", options->epoch, "Of a store, as `unimapper map list` numbers them")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 62));
  command->add_flag("--read-only", options->read_only, "Nobody may change the store from the page");
  command->footer("Example:\n  unimapper view site --http 127.0.0.1:8080");
  command->callback([options] { run_view(*options); });
}

}  // namespace unimapper::apps
