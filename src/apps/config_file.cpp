#include "src/apps/config_file.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <concepts>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "ports/datasets/files.hpp"

namespace unimapper::apps {
namespace {

// One function per struct lists its members in order. A test counts them, so that none is
// forgotten.

template <typename Config, typename Target>
concept Is = std::same_as<std::remove_const_t<Config>, Target>;

template <Is<KeyframeConfig> Config, typename Visitor>
void visit_members(Config& config, Visitor& visitor) {
  visitor("scans", config.scans);
  visitor("distance_m", config.distance_m);
  visitor("range_min_m", config.range_min_m);
  visitor("range_max_m", config.range_max_m);
  visitor("downsample_leaf_m", config.downsample_leaf_m);
  visitor("max_pose_step_m", config.max_pose_step_m);
  visitor("max_speed_mps", config.max_speed_mps);
  visitor("max_points_per_scan", config.max_points_per_scan);
}

template <Is<VoxelConfig> Config, typename Visitor>
void visit_members(Config& config, Visitor& visitor) {
  visitor("fine_size_m", config.fine_size_m);
  visitor("coarse_size_m", config.coarse_size_m);
  visitor("plane_max_eigenvalue_m2", config.plane_max_eigenvalue_m2);
  visitor("plane_min_points", config.plane_min_points);
  visitor("max_cells", config.max_cells);
  visitor("max_window_blocks", config.max_window_blocks);
  visitor("max_voxels", config.max_voxels);
}

template <Is<GroundConfig> Config, typename Visitor>
void visit_members(Config& config, Visitor& visitor) {
  visitor("max_tilt_deg", config.max_tilt_deg);
  visitor("margin_m", config.margin_m);
  visitor("below_depth_m", config.below_depth_m);
  visitor("own_plane_first", config.own_plane_first);
  visitor("elevated_step_m", config.elevated_step_m);
  visitor("elevated_reach_m", config.elevated_reach_m);
  visitor("seen_through_share", config.seen_through_share);
  visitor("propagation_voxels", config.propagation_voxels);
}

template <Is<FreeSpaceConfig> Config, typename Visitor>
void visit_members(Config& config, Visitor& visitor) {
  visitor("columns", config.columns);
  visitor("visibility", config.visibility);
  visitor("images_per_keyframe", config.images_per_keyframe);
  visitor("earlier_image_stride", config.earlier_image_stride);
  visitor("azimuth_resolution_deg", config.azimuth_resolution_deg);
  visitor("elevation_resolution_deg", config.elevation_resolution_deg);
  visitor("horizontal_fov_deg", config.horizontal_fov_deg);
  visitor("elevation_min_deg", config.elevation_min_deg);
  visitor("elevation_max_deg", config.elevation_max_deg);
  visitor("min_returns", config.min_returns);
  visitor("range_margin_m", config.range_margin_m);
  visitor("range_margin_relative", config.range_margin_relative);
  visitor("full_weight_range_m", config.full_weight_range_m);
  visitor("own_keyframe", config.own_keyframe);
}

template <Is<RemovalConfig> Config, typename Visitor>
void visit_members(Config& config, Visitor& visitor) {
  visitor("window", config.window);
  visitor("candidates_next_to_ground", config.candidates_next_to_ground);
  visitor("log_odds_free", config.log_odds_free);
  visitor("log_odds_occupied", config.log_odds_occupied);
  visitor("log_odds_weakly_occupied", config.log_odds_weakly_occupied);
  visitor("components", config.components);
  visitor("connecting_height_m", config.connecting_height_m);
  visitor("component_dynamic_share", config.component_dynamic_share);
  visitor("component_static_share", config.component_static_share);
  visitor("log_odds_clamp", config.log_odds_clamp);
  visitor("confirmed_static_log_odds", config.confirmed_static_log_odds);
  visitor("persistence_share", config.persistence_share);
  visitor("final_labels", config.final_labels);
}

template <Is<DescriptorConfig> Config, typename Visitor>
void visit_members(Config& config, Visitor& visitor) {
  visitor("voxel_size_m", config.voxel_size_m);
  visitor("max_cells", config.max_cells);
  visitor("max_voxels", config.max_voxels);
  visitor("max_keypoints", config.max_keypoints);
  visitor("max_planes", config.max_planes);
  visitor("range_m", config.range_m);
  visitor("column_size_m", config.column_size_m);
  visitor("min_height_m", config.min_height_m);
  visitor("window_m", config.window_m);
  visitor("suppression_radius_m", config.suppression_radius_m);
  visitor("max_candidates", config.max_candidates);
  visitor("plane_min_cells", config.plane_min_cells);
  visitor("plane_max_variance_m2", config.plane_max_variance_m2);
}

template <Is<TriangleConfig> Config, typename Visitor>
void visit_members(Config& config, Visitor& visitor) {
  visitor("neighbours", config.neighbours);
  visitor("min_side_m", config.min_side_m);
  visitor("max_side_m", config.max_side_m);
  visitor("min_height_m", config.min_height_m);
  visitor("max_triangles", config.max_triangles);
}

template <Is<LoopSearchConfig> Config, typename Visitor>
void visit_members(Config& config, Visitor& visitor) {
  visitor("max_places", config.max_places);
  visitor("max_results", config.max_results);
  visitor("max_keypoints", config.max_keypoints);
  visitor("max_planes", config.max_planes);
  visitor("voxel_size_m", config.voxel_size_m);
  visitor("triangles", config.triangles);
  visitor("side_tolerance_m", config.side_tolerance_m);
  visitor("dot_tolerance", config.dot_tolerance);
  visitor("max_code_difference", config.max_code_difference);
  visitor("max_bucket", config.max_bucket);
  visitor("max_compared", config.max_compared);
  visitor("max_matches", config.max_matches);
  visitor("max_candidates", config.max_candidates);
  visitor("max_per_session", config.max_per_session);
  visitor("max_verified", config.max_verified);
  visitor("inlier_distance_m", config.inlier_distance_m);
  visitor("min_inliers", config.min_inliers);
  visitor("max_tilt_rad", config.max_tilt_rad);
  visitor("accept_confidence", config.accept_confidence);
}

template <Is<SearchScope> Config, typename Visitor>
void visit_members(Config& config, Visitor& visitor) {
  visitor("sessions", config.sessions);
  visitor("min_keyframe_gap", config.min_keyframe_gap);
}

template <Is<PipelineConfig> Config, typename Visitor>
void visit_members(Config& config, Visitor& visitor) {
  // `clock_ns` and `events` are no parameters: the program decides where times come from and where
  // events go.
  visitor("keyframe", config.keyframe);
  visitor("voxel", config.voxel);
  visitor("ground", config.ground);
  visitor("free_space", config.free_space);
  visitor("removal", config.removal);
  visitor("descriptor", config.descriptor);
  visitor("loop_search", config.loop_search);
  visitor("search_scope", config.search_scope);
  visitor("budget_us", config.budget_us);
}

constexpr std::array<const char*, 3> kSessionScopes = {"all", "only_same", "only_other"};

/// Turns a config struct into JSON.
class Dumper {
 public:
  void operator()(const char* name, bool value) { json_[name] = value; }
  void operator()(const char* name, std::uint32_t value) { json_[name] = value; }
  /// The shortest decimal that is the same float: 0.2, not 0.20000000298.
  void operator()(const char* name, float value) {
    std::array<char, 32> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
    double shortest = 0.0;
    std::from_chars(text.data(), end, shortest);
    json_[name] = shortest;
  }
  void operator()(const char* name, SearchScope::Sessions value) {
    json_[name] = kSessionScopes.at(static_cast<std::size_t>(value));
  }
  template <typename Config>
  void operator()(const char* name, const Config& config) {
    Dumper members;
    visit_members(config, members);
    json_[name] = members.json();
  }
  [[nodiscard]] const nlohmann::ordered_json& json() const { return json_; }

 private:
  nlohmann::ordered_json json_ = nlohmann::ordered_json::object();
};

/// Overwrites the members of a config struct that a JSON object names.
class Reader {
 public:
  Reader(const nlohmann::json& json, std::string path, const std::filesystem::path& file)
      : json_(json), path_(std::move(path)), file_(file) {
    if (!json_.is_object()) refuse(path_.empty() ? "the file" : path_, "must be an object");
  }

  void operator()(const char* name, bool& value) {
    const auto* json = find(name);
    if (json == nullptr) return;
    if (!json->is_boolean()) refuse(key(name), "must be true or false");
    value = json->get<bool>();
  }
  void operator()(const char* name, std::uint32_t& value) {
    const auto* json = find(name);
    if (json == nullptr) return;
    constexpr std::uint64_t kMax = std::numeric_limits<std::uint32_t>::max();
    if (!json->is_number_unsigned() || json->get<std::uint64_t>() > kMax) {
      refuse(key(name), "must be a whole number from 0 to 4294967295");
    }
    value = json->get<std::uint32_t>();
  }
  void operator()(const char* name, float& value) {
    const auto* json = find(name);
    if (json == nullptr) return;
    if (!json->is_number()) refuse(key(name), "must be a number");
    const auto number = json->get<double>();
    // Written so that NaN is refused too.
    if (!(std::abs(number) <= std::numeric_limits<float>::max())) {
      refuse(key(name), "is out of range");
    }
    value = static_cast<float>(number);
  }
  void operator()(const char* name, SearchScope::Sessions& value) {
    const auto* json = find(name);
    if (json == nullptr) return;
    for (std::size_t i = 0; i < kSessionScopes.size(); ++i) {
      if (json->is_string() && json->get<std::string>() == kSessionScopes[i]) {
        value = static_cast<SearchScope::Sessions>(i);
        return;
      }
    }
    refuse(key(name), "must be \"all\", \"only_same\" or \"only_other\"");
  }
  template <typename Config>
  void operator()(const char* name, Config& config) {
    const auto* json = find(name);
    if (json == nullptr) return;
    Reader members(*json, key(name), file_);
    visit_members(config, members);
    members.refuse_unknown_keys();
  }

  void refuse_unknown_keys() const {
    for (const auto& entry : json_.items()) {
      bool is_known = false;
      for (const std::string& name : names_) is_known = is_known || name == entry.key();
      if (!is_known) refuse(key(entry.key()), "is no parameter");
    }
  }

 private:
  [[noreturn]] void refuse(const std::string& what, const std::string& reason) const {
    throw std::runtime_error(file_.string() + ": " + what + ": " + reason);
  }
  [[nodiscard]] std::string key(const std::string& name) const {
    return path_.empty() ? name : path_ + "." + name;
  }
  const nlohmann::json* find(const char* name) {
    names_.emplace_back(name);
    const auto found = json_.find(name);
    return found == json_.end() ? nullptr : &*found;
  }

  const nlohmann::json& json_;
  std::string path_;
  const std::filesystem::path& file_;
  std::vector<std::string> names_;
};

nlohmann::json parse_json(std::string_view text, const std::filesystem::path& file) {
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    const std::string what = error.what();
    const std::size_t prefix = what.find("] ");
    throw std::runtime_error(file.string() + ": " +
                             (prefix == std::string::npos ? what : what.substr(prefix + 2)));
  }
}

}  // namespace

void parse_config(std::string_view text, const std::filesystem::path& file,
                  PipelineConfig& config) {
  const nlohmann::json json = parse_json(text, file);
  Reader reader(json, "", file);
  visit_members(config, reader);
  reader.refuse_unknown_keys();
  const Error error = config.validate();
  if (error.code != ErrorCode::kOk) throw std::runtime_error(file.string() + ": " + error.message);
}

void read_config(const std::filesystem::path& file, PipelineConfig& config) {
  parse_config(datasets::read_file(file), file, config);
}

std::string dump_config(const PipelineConfig& config) {
  Dumper dumper;
  visit_members(config, dumper);
  return dumper.json().dump(2) + "\n";
}

}  // namespace unimapper::apps
