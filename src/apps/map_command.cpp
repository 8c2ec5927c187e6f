// `unimapper map`: the command line of src/apps/map.
#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "src/apps/commands.hpp"
#include "src/apps/export_options.hpp"
#include "src/apps/map/map_options.hpp"
#include "src/apps/nats_options.hpp"

namespace unimapper::apps {
namespace {

/// Everything that a command of `unimapper map` may be given.
struct MapOptions {
  ProjectOptions project;
  std::vector<std::filesystem::path> runs;
  std::vector<std::string> sessions;
  bool purges = false;
  SurveyOptions survey;
  std::string session;
  KeyframesOption keyframes;
  PositionOption position;
  std::filesystem::path graph;
  std::vector<std::int64_t> statements;
  MapMergeOptions merge;
  MapExportOptions output;
};

/// Commands below `unimapper map`, each with its own options.
class MapCommands {
 public:
  explicit MapCommands(CLI::App& map) : map_(map) {}

  /// `example`: the arguments besides the store.
  CLI::App* add(const std::string& name, const char* description, const char* example,
                const std::function<void(CLI::App&, MapOptions&)>& options,
                const std::function<void(const MapOptions&)>& run) {
    auto given = std::make_shared<MapOptions>();
    CLI::App* command = map_.add_subcommand(name, description);
    command->add_option("--store", given->project.store, "Folder of the store")->required();
    command->footer("Example:\n  unimapper map " + name + " --store site" +
                    (*example == '\0' ? "" : " ") + example);
    options(*command, *given);
    command->callback([given, run] { run(*given); });
    return command;
  }

 private:
  CLI::App& map_;
};

void add_json(CLI::App& command, MapOptions& options) {
  command.add_flag("--json", options.project.json, "The same as JSON");
}

void add_memory(CLI::App& command, std::optional<std::uint32_t>& memory_mb) {
  command
      .add_option("--memory", memory_mb,
                  "Megabytes for keyframes and clouds; the map does not depend on it")
      ->check(CLI::Range(1, 1'000'000));
}

void add_epoch(CLI::App& command, MapOptions& options, const char* description) {
  command.add_option("--epoch", options.project.epoch, description)
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 62));
}

void add_sessions(CLI::App& command, MapOptions& options) {
  command.add_option("SESSION", options.sessions, "Sessions, by name")->required();
}

void add_keyframes(CLI::App& command, MapOptions& options) {
  command.add_option("QUERY", options.keyframes.query, "A keyframe: SESSION:NUMBER")->required();
  command.add_option("MATCH", options.keyframes.match, "The other one")->required();
}

void register_sessions(MapCommands& commands) {
  commands.add(
      "create", "Make a store", "", [](CLI::App&, MapOptions&) {},
      [](const MapOptions& o) { create_project(o.project); });
  commands.add(
      "add", "Take runs into the store; what is there already stays", "runs/monday runs/friday",
      [](CLI::App& command, MapOptions& o) {
        command.add_option("RUN", o.runs, "Run folders of `unimapper onboard`, or LCM event logs")
            ->required();
      },
      [](const MapOptions& o) { add_runs(o.project, o.runs); });
  commands.add(
      "survey", "Take the point cloud of a static map in as a session that is fixed",
      "hall.ply --name hall",
      [](CLI::App& command, MapOptions& o) {
        command.add_option("FILE", o.survey.file, "PLY or PCD, metres, z up")->required();
        command.add_option("--name", o.survey.name, "Of the session, instead of the file's");
        command.add_option("--spacing", o.survey.spacing_m, "Of virtual viewpoints, metres")
            ->capture_default_str()
            ->check(CLI::Range(1.0, 100.0));
        command.add_option("--height", o.survey.height_m, "Of viewpoints above the ground, metres")
            ->capture_default_str()
            ->check(CLI::Range(0.3, 10.0));
        command.add_option("--range", o.survey.range_m, "Of what is seen from them, metres")
            ->capture_default_str()
            ->check(CLI::Range(10.0, 200.0));
        command.add_flag("--unplaced", o.survey.is_unplaced,
                         "Its frame is not the site's: it is the reference, without positions");
      },
      [](const MapOptions& o) { add_survey(o.project, o.survey); });
  commands.add(
      "remove", "Take sessions out of the project; the store keeps them", "friday",
      [](CLI::App& command, MapOptions& o) {
        add_sessions(command, o);
        command.add_flag("--purge", o.purges,
                         "Out of the store, too, for good: no undo, and epochs that show them are "
                         "gone with them");
      },
      [](const MapOptions& o) {
        o.purges ? purge_sessions(o.project, o.sessions) : remove_sessions(o.project, o.sessions);
      });
}

void register_statements(MapCommands& commands) {
  commands.add(
      "link", "Say that two keyframes show the same surroundings", "friday:12 monday:40",
      [](CLI::App& command, MapOptions& o) {
        add_keyframes(command, o);
        command
            .add_option("--pose", o.keyframes.pose,
                        "x y z qx qy qz qw of the query's sensor in the match's, as in loops.csv")
            ->expected(7);
        command.add_flag("--force", o.keyframes.is_forced, "Though the scans contradict it");
      },
      [](const MapOptions& o) { link_keyframes(o.project, o.keyframes); });
  commands.add("forbid", "Say that the loop between two keyframes is wrong", "friday:12 monday:40",
               add_keyframes, [](const MapOptions& o) { forbid_loop(o.project, o.keyframes); });
  commands.add(
      "pin", "Say which session's frame is the map's", "monday",
      [](CLI::App& command, MapOptions& o) {
        command.add_option("SESSION", o.session, "The session, by name")->required();
      },
      [](const MapOptions& o) { pin_reference(o.project, o.session); });
  commands.add("apart", "Say that sessions stay apart from the map", "friday", add_sessions,
               [](const MapOptions& o) { keep_apart(o.project, o.sessions); });
  commands.add(
      "withdraw", "Take back what was said", "3",
      [](CLI::App& command, MapOptions& o) {
        command.add_option("NUMBER", o.statements, "Statements, as `map show` numbers them")
            ->required();
      },
      [](const MapOptions& o) { withdraw_statements(o.project, o.statements); });
}

void add_lever(CLI::App& command, MapOptions& o) {
  command
      .add_option("--lever", o.position.lever,
                  "x y z of the point in the sensor's frame, metres; else it is the sensor")
      ->expected(3);
}

void register_positions(MapCommands& commands) {
  commands.add(
      "position", "Say where a keyframe is",
      "monday:12 --at 691234.5 5335678.9 512.3 --sigma 0.02 0.05",
      [](CLI::App& command, MapOptions& o) {
        command.add_option("KEYFRAME", o.position.keyframe, "SESSION:NUMBER")->required();
        auto* where = command.add_option_group("Where", "One of these");
        where->add_option("--at", o.position.at, "x y z in the site frame, metres")->expected(3);
        where->add_option("--height", o.position.height_m, "Only the height is known: z, metres");
        where->require_option(1);
        command
            .add_option("--sigma", o.position.sigma,
                        "Standard deviation, or that of x and of y, then that of z; metres")
            ->expected(1, 2)
            ->required();
        add_lever(command, o);
      },
      [](const MapOptions& o) { give_position(o.project, o.position); });
  commands.add(
      "crs", "Say which coordinate system the positions are in", "EPSG:25832",
      [](CLI::App& command, MapOptions& o) {
        command.add_option("NAME", o.output.output.crs.name, kSystemHelp)->required();
      },
      [](const MapOptions& o) { set_system(o.project, o.output.output.crs.name); });
  commands.add(
      "positions", "Say where keyframes of a session are",
      "friday --file gnss.csv --lever 0.3 0 0.8",
      [](CLI::App& command, MapOptions& o) {
        command.add_option("SESSION", o.position.session, "The session, by name")->required();
        command
            .add_option("--file", o.position.file,
                        "CSV below a line of names: keyframe or stamp, then "
                        "x,y,z,sigma_xy,sigma_z or z,sigma_z or "
                        "latitude,longitude,height,sigma_xy,sigma_z")
            ->required();
        command
            .add_option("--datum", o.position.datum,
                        "Latitude, longitude, height on WGS84 of the site frame's origin, east is "
                        "x, north is y")
            ->expected(3);
        add_lever(command, o);
      },
      [](const MapOptions& o) { give_positions(o.project, o.position); });
}

void register_epochs(MapCommands& commands) {
  commands.add("list", "Print all epochs", "", add_json,
               [](const MapOptions& o) { list_epochs(o.project); });
  commands.add(
      "show", "Print sessions, statements and loops", "--json",
      [](CLI::App& command, MapOptions& o) {
        add_json(command, o);
        add_epoch(command, o, "As of that epoch instead of the latest");
      },
      [](const MapOptions& o) { show_epoch(o.project); });
  commands.add(
      "undo", "Go back; this is an epoch too, nothing is lost", "",
      [](CLI::App& command, MapOptions& o) {
        add_epoch(command, o, "To that epoch instead of the one before");
      },
      [](const MapOptions& o) { undo_epoch(o.project); });
  commands.add("check", "Read all of the store and say what is wrong", "", add_json,
               [](const MapOptions& o) { check_project(o.project); });
}

void register_maps(MapCommands& commands) {
  commands.add(
      "merge", "Merge the sessions; loops that were verified before are not again", "",
      [](CLI::App& command, MapOptions& o) {
        command.add_option("--config", o.merge.config,
                           "JSON file with parameters that differ from the default");
        command
            .add_option("--threads", o.merge.threads,
                        "Threads to use; 0: all. The map does not depend on it")
            ->check(CLI::Range(0, 256));
        add_memory(command, o.merge.memory_mb);
        command.add_option("--workers", o.merge.workers.url,
                           "nats://HOST:PORT where `unimapper worker` takes loops to verify");
        add_nats_credentials(command, o.merge.workers);
      },
      [](const MapOptions& o) { merge_project(o.project, o.merge); });
  commands.add(
      "import", "Take poses that another program has optimised", "graph.g2o",
      [](CLI::App& command, MapOptions& o) {
        command
            .add_option("GRAPH", o.graph, "g2o file with the vertices of the exported graph.g2o")
            ->required();
      },
      [](const MapOptions& o) { import_poses(o.project, o.graph); });
  commands.add(
      "export", "Write the map as `unimapper merge` does", "--out map",
      [](CLI::App& command, MapOptions& o) {
        command.add_option("--out", o.output.out, "Folder for the map")->required();
        command.add_flag("--replace", o.output.replaces,
                         "Overwrite an earlier map in that folder, and the file of --mcap");
        command.add_option("--mcap", o.output.mcap, "Write the map as MCAP, too");
        add_reference_options(command, o.output.reference);
        add_export_options(command, o.output.output);
        add_memory(command, o.output.memory_mb);
        add_epoch(command, o, "Of that epoch instead of the latest");
      },
      [](const MapOptions& o) { export_project(o.project, o.output); });
}

}  // namespace

void register_project(CLI::App& app) {
  CLI::App* map = app.add_subcommand(
      "map", "Keep sessions, what people say and maps in a store, change by change");
  map->require_subcommand(1);
  MapCommands commands(*map);
  register_sessions(commands);
  register_maps(commands);
  register_statements(commands);
  register_positions(commands);
  register_epochs(commands);
  map->footer(
      "Example:\n"
      "  unimapper map create --store site\n"
      "  unimapper map add    --store site runs/monday runs/friday\n"
      "  unimapper map merge  --store site\n"
      "  unimapper map export --store site --out map");
}

}  // namespace unimapper::apps
