#include "src/apps/view/map_files.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "src/apps/view/evaluation_files.hpp"
#include "src/apps/view/map_view.hpp"
#include "src/apps/view/page_parts.hpp"
#include "src/apps/view/page_text.hpp"

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostKeyframes = 200;
/// Points of a keyframe: enough to see whether two of them lie on each other.
constexpr std::size_t kKeyframePoints = 2000;
/// One part of so many of a page's points is for keyframes.
constexpr std::uint64_t kKeyframeShare = 4;
/// File of times beside map.json, which is the same for the same map.
constexpr const char* kTimesFile = "times.json";
constexpr std::string_view kMarker = "<!-- data -->";

/// All keyframes, or where there are many those of loops: accepted ones last.
std::set<std::pair<std::size_t, std::size_t>> shown_keyframes(
    const std::vector<SessionData>& sessions, const merge::MergeResult& result) {
  std::set<std::pair<std::size_t, std::size_t>> chosen;
  std::size_t count = 0;
  for (const SessionData& session : sessions) count += session.keyframes.size();
  if (count <= kMostKeyframes) {
    for (std::size_t s = 0; s < sessions.size(); ++s) {
      for (std::size_t k = 0; k < sessions[s].keyframes.size(); ++k) chosen.insert({s, k});
    }
    return chosen;
  }
  for (const bool accepted : {false, true}) {
    for (const merge::LoopConstraint& loop : result.loops) {
      if (loop.decision.accepted != accepted || chosen.size() + 2 > kMostKeyframes) continue;
      chosen.insert({loop.query.session, loop.query.keyframe});
      chosen.insert({loop.match.session, loop.match.keyframe});
    }
  }
  return chosen;
}

std::string keyframe_name(std::size_t session, std::size_t keyframe) {
  return "keyframe/" + std::to_string(session) + "/" + std::to_string(keyframe);
}

std::optional<std::string> read_if_there(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(in), {});
}

std::string with_times(const std::string& map, const std::string& times,
                       const std::filesystem::path& file) {
  try {
    Json json = Json::parse(map);
    json.update(Json::parse(times));
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
  } catch (const Json::exception& error) {
    throw std::runtime_error(file.string() + ": holds no times: " + error.what());
  }
}

}  // namespace

MapFiles map_files(const std::string& title, const std::vector<SessionData>& sessions,
                   const merge::MergeResult& result, float voxel_m) {
  MapFiles files;
  files.blocks = BlockList(result.map.file());
  const Layers layers = layers_of(sessions, result, voxel_m);
  for (const auto& [name, octree] : layers) {
    for (const OctreeNode& node : octree.nodes) {
      files.blocks.add(name + "/" + node.key, *octree.blocks.read(node.key));
    }
  }
  for (const auto& [s, k] : shown_keyframes(sessions, result)) {
    const auto keyframe = whole_keyframe(sessions[s], k);
    const auto& labels = result.sessions[s].refined;
    files.blocks.add(keyframe_name(s, k),
                     keyframe_block(*keyframe, labels.empty() ? nullptr : &labels[k],
                                    session_byte(s), kKeyframePoints));
  }
  Json json;
  json["format"] = 1;
  json["title"] = title;
  json["source"] = "map";
  json["epoch"] = 0;
  // Browsers keep blocks for ever: those of another map at the same address have another version.
  json["version"] = files.blocks.checksum();
  json["can_change"] = false;
  json["epochs"] = Json::array();
  json.update(describe_merge(sessions, result));
  json["layers"] = describe_layers(layers);
  files.json = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  return files;
}

void write_map_files(const std::filesystem::path& folder, const MapFiles& files) {
  write_page_file(folder / "map.json", files.json);
  if (!files.times.empty()) write_page_file(folder / kTimesFile, files.times);
  write_blocks(folder, files.blocks);
}

std::string page_with(const MapFiles& files, std::uint64_t max_bytes, const PageExtras& extras) {
  Json json = Json::parse(files.json);
  if (!files.times.empty()) json.update(Json::parse(files.times));
  json["source"] = "file";
  std::set<std::string> there;
  std::string data =
      block_elements(files.blocks, false, max_bytes - max_bytes / kKeyframeShare, there);
  data += block_elements(files.blocks, true, max_bytes - data.size(), there);
  json["points_left_out"] = leave_absent_nodes_out(json["layers"], there);
  data += map_element(json);
  if (!extras.report.empty()) {
    data.append("<template id=\"report\">").append(extras.report).append("</template>\n");
  }
  if (!extras.picture.empty()) {
    data.append("<script type=\"text/plain\" id=\"flat-picture\">data:image/svg+xml;base64,")
        .append(base64_text(extras.picture))
        .append("</script>\n");
  }
  std::string page = empty_page();
  const std::size_t at = page.find(kMarker);
  if (at == std::string::npos) throw std::runtime_error("the page has no place for a map");
  return page.replace(at, kMarker.size(), data);
}

std::string empty_page() { return std::string(page_text()); }

FolderView::FolderView(std::filesystem::path folder) : folder_(std::move(folder)) {
  std::optional<std::string> json = read_if_there(folder_ / "map.json");
  if (!json) {
    throw std::runtime_error(folder_.string() +
                             ": holds no map.json; is it of a map that `unimapper merge` or "
                             "`unimapper map export` wrote?");
  }
  if (const auto times = read_if_there(folder_ / kTimesFile)) {
    json = with_times(*json, *times, folder_ / kTimesFile);
  }
  if (const auto evaluation = read_if_there(folder_ / kEvaluationFile)) {
    json = with_evaluation(*json, *evaluation, (folder_ / kEvaluationFile).string());
  }
  json_ = std::make_shared<const std::string>(std::move(*json));
}

std::optional<std::string> FolderView::block(const std::string& /*version*/,
                                             const std::string& layer, const std::string& key) {
  // The server lets letters, digits and "_" pass: no name leaves the folder.
  return read_if_there(folder_ / block_file(layer + "/" + key));
}

std::optional<std::string> FolderView::keyframe(const std::string& /*version*/, std::size_t session,
                                                std::size_t keyframe) {
  return read_if_there(folder_ / block_file(keyframe_name(session, keyframe)));
}

}  // namespace unimapper::apps
