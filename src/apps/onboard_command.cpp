// `unimapper onboard`: the command line of src/apps/onboard.
#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "src/apps/commands.hpp"
#include "src/apps/input_options.hpp"
#include "src/apps/onboard/onboard_options.hpp"
#include "unimapper/core/executor.hpp"

namespace unimapper::apps {
namespace {

void add_input_options(CLI::App& command, OnboardOptions& options) {
  command.add_option("DATASET", options.dataset, "Folder of the recording");
  add_open_options(command, options.input);
  add_sensor_file_option(command, options.sensor_file);
  command.add_option("--scans", options.scans, "Use only the first so many scans")
      ->check(CLI::PositiveNumber);
}

void add_output_options(CLI::App& command, OnboardOptions& options) {
  command.add_option("--out", options.out,
                     "Folder for labels, keyframes, loops and statistics; its name becomes the "
                     "session's");
  command.add_flag("--replace", options.replaces, "Overwrite an earlier run in that folder");
  command.add_option("--publish", options.publish,
                     "Stream the keyframes too, e.g. to udpm://239.255.76.67:7667?ttl=0");
  command.add_option("--key", options.key,
                     "The robot's key (unimapper keys): sign the keyframes, authenticate what is "
                     "published, and hear only bases that have the key");
  CLI::Option* share =
      command.add_option("--share", options.share,
                         "Share keyframes, labels and health in shared memory under this name, for "
                         "programs on this computer (see unimapper watch)");
  command
      .add_option("--share-doorbell", options.share_doorbell,
                  "Announce what --share has on this LCM URL too, for programs on this computer "
                  "that live in an LCM loop, e.g. udpm://239.255.76.67:7667?ttl=0")
      ->needs(share);
}

void add_link_options(CLI::App& command, OnboardOptions& options) {
  command
      .add_option("--datagram-bytes", options.datagram_bytes,
                  "Largest datagram of --publish; 1300 fits an Ethernet frame, for Wi-Fi")
      ->capture_default_str()
      ->check(CLI::Range(256, 60000));
  command
      .add_option("--bytes-per-second", options.bytes_per_second,
                  "Highest average rate of --publish; below it, the rate follows the link")
      ->capture_default_str()
      ->check(CLI::Range(1e3, 1e10));
  command
      .add_option("--min-bytes-per-second", options.min_bytes_per_second,
                  "Lowest rate of --publish, however much the link loses")
      ->capture_default_str()
      ->check(CLI::Range(500.0, 1e10));
  command
      .add_option("--unacknowledged-bytes", options.unacknowledged_bytes,
                  "Memory for keyframes that no base has acknowledged yet; the oldest are evicted")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  command.add_option("--spool", options.spool,
                     "Folder that keeps the keyframes until a base has them, over restarts; those "
                     "of earlier starts in it are sent too. Without it, in memory only");
  command
      .add_option("--spool-bytes", options.spool_bytes,
                  "Disk space of --spool; beyond it the oldest keyframes go, acknowledged ones "
                  "first")
      ->capture_default_str()
      ->check(CLI::Range(1e6, 1e15));
}

void add_processing_options(CLI::App& command, OnboardOptions& options) {
  command
      .add_option("--preset", options.preset,
                  "Parameters to start from: the default, the paper's, or the default within the "
                  "memory of a smaller computer")
      ->capture_default_str()
      ->check(CLI::IsMember({"default", "paper", "jetson", "raspberry-pi", "armv7-64mb"}));
  command
      .add_option("--surroundings", options.surroundings,
                  "Shorter keyframes and finer descriptions indoors; auto: as the first scans say")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "indoors", "outdoors"}));
  command.add_option("--config", options.config, "JSON file with parameters that differ from it");
  command.add_flag("--force", options.force,
                   "Map the recording even if it looks surely wrong (units, poses, records)");
  command.add_flag("--realtime", options.realtime, "Feed the scans at the pace of their stamps");
  command
      .add_option("--workers", options.workers,
                  "Processors that close a keyframe together, each with a thread of the priority "
                  "that the command was started with. The results do not depend on it")
      ->capture_default_str()
      ->check(CLI::Range(1U, Executor::kMaxWorkers));
  command.add_flag(
      "--deferred", options.deferred,
      "Close keyframes, describe, search and relabel in slices, in the calls that follow, as on a "
      "robot: the same results, later, and no long call");
  command.add_flag("--intensity", options.intensity,
                   "Keyframes carry intensities, where the recording has them, even if they are "
                   "sent (--publish, --spool): a byte for each cell. Always on disk");
  command.add_option("--against", options.against,
                     "Search the places of an earlier run too; may be given more than once");
  command.add_flag("--all-candidates", options.all_candidates,
                   "List loop candidates below the threshold too, with accepted = 0");
  command.add_flag("--final-labels", options.final_labels,
                   "Write OUT/final/labels too: labels with the evidence of later keyframes");
}

}  // namespace

void register_onboard(CLI::App& app) {
  auto options = std::make_shared<OnboardOptions>();
  auto dump = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand(
      "onboard",
      "Replay a recording through the robot's pipeline: labels, keyframes, loops, statistics");
  add_input_options(*command, *options);
  add_output_options(*command, *options);
  add_link_options(*command, *options);
  for (const char* name : {"--publish", "--key", "--share", "--share-doorbell", "--datagram-bytes",
                           "--bytes-per-second", "--min-bytes-per-second", "--unacknowledged-bytes",
                           "--spool", "--spool-bytes"}) {
    command->get_option(name)->group("Sending and sharing");
  }
  add_processing_options(*command, *options);
  command->add_flag("--dump-config", *dump, "Print the parameters that would be used, and stop");
  command->footer(
      "Examples:\n"
      "  unimapper onboard recordings/monday --sensor os2-128 --out runs/monday\n"
      "  unimapper onboard recordings/friday --out runs/friday --against runs/monday");
  command->callback([options, dump] {
    if (*dump) {
      std::cout << effective_config(*options);
      return;
    }
    if (options->dataset.empty()) throw CLI::RequiredError("DATASET");
    if (options->out.empty()) throw CLI::RequiredError("--out");
    run_onboard(*options);
  });
}

}  // namespace unimapper::apps
