// `unimapper parameters`: the parameter tables as the Markdown of docs/parameters.md.
#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "src/apps/commands.hpp"
#include "unimapper/config/config_json.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::apps {
namespace {

constexpr const char* kIntroduction =
    "# Parameters\n\n"
    "Printed by `unimapper parameters` from the tables behind the configuration structs; a test "
    "fails\n"
    "where this file differs. Names are those of the JSON files for `--config` (nested at the "
    "dots)\n"
    "and of `um_config_set`. Ranges: `[` and `]` include the bound, `(` does not. Sources of the\n"
    "defaults: *paper* is the Uni-Mapper paper, *STD* the descriptor it builds on, *measured* the\n"
    "comparison in [tuning.md](tuning.md) or [results.md](results.md), *sensor* the data sheet by "
    "way\n"
    "of the preset (`unimapper onboard --sensor NAME --dump-config` prints what a preset sets),\n"
    "*choice* our own.\n";

template <typename Config>
void print(const std::string& heading) {
  const Config defaults;
  std::cout << "\n## " << heading << '\n' << parameters_as_markdown(kParameters<Config>, &defaults);
}

}  // namespace

void register_parameters(CLI::App& app) {
  CLI::App* const command = app.add_subcommand("parameters", "Print docs/parameters.md");
  command->group("");  // for those who build the project
  command->callback([] {
    std::cout << kIntroduction;
    print<PipelineConfig>("Robot: `PipelineConfig`, `unimapper onboard --config`");
    print<merge::MergeConfig>("Base: `merge::MergeConfig`, `unimapper merge --config`");
  });
}

}  // namespace unimapper::apps
