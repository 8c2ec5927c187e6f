// Steps of `unimapper map`. All throw std::runtime_error with a sentence for the user.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ports/nats/server.hpp"
#include "src/apps/merge/session_references.hpp"
#include "unimapper/merge/export.hpp"

namespace unimapper::apps {

/// Where the project is.
struct ProjectOptions {
  std::filesystem::path store;  ///< folder of the store
  bool json = false;            ///< what is printed is JSON
  std::int64_t epoch = 0;       ///< 0: the latest; of an undo: the one before
};

/// Makes a store, which must not be there.
void create_project(const ProjectOptions& options);
/// Takes run folders and event logs into the store. What is there already stays as it is.
void add_runs(const ProjectOptions& options, const std::vector<std::filesystem::path>& runs);
/// Of `map survey`.
struct SurveyOptions {
  std::filesystem::path file;  ///< PLY or PCD
  std::string name;            ///< of the session; empty: as the file
  double spacing_m = 10.0;     ///< of virtual viewpoints
  double height_m = 1.8;       ///< of virtual viewpoints above the ground
  double range_m = 60.0;       ///< of what is seen from virtual viewpoints
  bool is_unplaced = false;    ///< its frame is not the site's
};

/// Takes the point cloud of a static map in as a session that is fixed.
void add_survey(const ProjectOptions& options, const SurveyOptions& survey);
/// Takes sessions out of the project; the store keeps them.
void remove_sessions(const ProjectOptions& options, const std::vector<std::string>& names);
/// Takes sessions out of the store for good; epochs that show them cannot be gone back to.
void purge_sessions(const ProjectOptions& options, const std::vector<std::string>& names);

/// Two keyframes, each as "SESSION:NUMBER", and the pose of the query's sensor in the match's
/// sensor frame as in loops.csv: x y z qx qy qz qw; empty: not known.
struct KeyframesOption {
  std::string query;
  std::string match;
  std::vector<double> pose;
  bool is_forced = false;  ///< though the scans contradict it
};

/// Where a keyframe's sensor, or a point at a lever arm from it, is in the site frame. Metres.
struct PositionOption {
  std::string keyframe;        ///< "SESSION:NUMBER"
  std::vector<double> at;      ///< x y z; empty: only the height is known
  double height_m = 0.0;       ///< where `at` is empty
  std::vector<double> sigma;   ///< standard deviation, or that of x and of y and that of z
  std::vector<double> lever;   ///< the point in the sensor's frame; empty: the sensor
  std::string session;         ///< of a file
  std::filesystem::path file;  ///< many positions (position_file.hpp)
  std::vector<double> datum;   ///< latitude, longitude, height of a file's frame; empty: metres
};

/// A person gives the position of a keyframe.
void give_position(const ProjectOptions& options, const PositionOption& position);
/// A person says which coordinate system the positions are in, as `Projection` takes its name.
void set_system(const ProjectOptions& options, const std::string& name);
/// A person gives a file of positions of a session.
void give_positions(const ProjectOptions& options, const PositionOption& positions);

/// A person links two keyframes. Throws where the scans contradict it, unless it is forced.
void link_keyframes(const ProjectOptions& options, const KeyframesOption& keyframes);
/// A person forbids the loop between two keyframes.
void forbid_loop(const ProjectOptions& options, const KeyframesOption& keyframes);
/// A person names the reference session.
void pin_reference(const ProjectOptions& options, const std::string& session);
/// A person keeps sessions apart from the map.
void keep_apart(const ProjectOptions& options, const std::vector<std::string>& sessions);
/// A person takes statements back, by their numbers.
void withdraw_statements(const ProjectOptions& options, const std::vector<std::int64_t>& numbers);
/// Goes back to an earlier epoch.
void undo_epoch(const ProjectOptions& options);

/// Prints all epochs.
void list_epochs(const ProjectOptions& options);
/// Prints sessions, statements and loops of an epoch.
void show_epoch(const ProjectOptions& options);
/// Prints what is wrong with the store; throws if anything is.
void check_project(const ProjectOptions& options);

/// Of `map merge`.
struct MapMergeOptions {
  std::filesystem::path config;          ///< JSON file with parameters that differ from the default
  std::optional<std::uint32_t> threads;  ///< instead of the configuration's
  std::optional<std::uint32_t> memory_mb;  ///< instead of the configuration's
  nats_port::Server workers;               ///< where workers take loops; no address: none
};

/// Merges the sessions of the latest epoch; the result is a new one.
void merge_project(const ProjectOptions& options, const MapMergeOptions& merge);

/// Makes an epoch whose map has the poses of a g2o file, numbered as export numbers them.
void import_poses(const ProjectOptions& options, const std::filesystem::path& graph);

/// Of `map export`.
struct MapExportOptions {
  std::filesystem::path out;               ///< folder for the map
  std::filesystem::path mcap;              ///< the map as a scene; empty: not written
  bool replaces = false;                   ///< overwrite an earlier map
  merge::ExportOptions output;             ///< how much of the map is written
  std::optional<std::uint32_t> memory_mb;  ///< instead of that of the merge
  ReferenceOptions reference;              ///< of sessions, for the report
};

/// Writes the map of an epoch's merge as `unimapper merge` does.
void export_project(const ProjectOptions& options, const MapExportOptions& output);

}  // namespace unimapper::apps
