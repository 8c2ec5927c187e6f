#include "src/apps/view/evaluation_files.hpp"

#include <fstream>
#include <initializer_list>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

#include "src/apps/view/page_parts.hpp"

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::initializer_list<const char*> kErrorLayers = {kFalseStatic, kFalseDynamic};

/// Puts what evaluation.json holds into the map.
void insert_evaluation(Json& map, Json&& file) {
  map["evaluation"] = std::move(file.at("evaluation"));
  Json& layers = map["layers"];
  for (const char* name : kErrorLayers) layers.erase(name);
  layers.update(file.at("layers"));
  const std::string version = map.at("version").get<std::string>();
  map["version"] =
      version.substr(0, version.find('.')) + "." + file.at("checksum").get<std::string>();
}

void erase_blocks(std::string& page) {
  for (const char* name : kErrorLayers) {
    const std::string begin = block_element(std::string(name) + "/");
    for (std::size_t at = 0; (at = page.find(begin, at)) != std::string::npos;) {
      const std::size_t end = page.find(kElementEnd, at);
      if (end == std::string::npos) return;
      page.erase(at, end + kElementEnd.size() - at);
    }
  }
}

std::string whole_text(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error(path.string() + ": cannot be read");
  return std::string(std::istreambuf_iterator<char>(in), {});
}

}  // namespace

EvaluationFiles evaluation_files(const Json& evaluation, const Layers& layers) {
  EvaluationFiles files;
  for (const auto& [name, octree] : layers) {
    for (const OctreeNode& node : octree.nodes) {
      files.blocks.add(name + "/" + node.key, *octree.blocks.read(node.key));
    }
  }
  const Json json = {{"evaluation", evaluation},
                     {"layers", describe_layers(layers)},
                     {"checksum", files.blocks.checksum()}};
  files.json = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  return files;
}

void write_evaluation_files(const std::filesystem::path& folder, const EvaluationFiles& files) {
  // First what names the blocks, last again: whoever is killed leaves no evaluation.
  std::filesystem::remove(folder / kEvaluationFile);
  for (const char* name : kErrorLayers) std::filesystem::remove_all(folder / name);
  write_blocks(folder, files.blocks);
  write_page_file(folder / kEvaluationFile, files.json);
}

std::string with_evaluation(const std::string& map, const std::string& evaluation,
                            const std::string& file) {
  try {
    Json json = Json::parse(map);
    insert_evaluation(json, Json::parse(evaluation));
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
  } catch (const Json::exception& error) {
    throw std::runtime_error(file + ": is no evaluation of this map: " + error.what());
  }
}

void add_evaluation_to_page(const std::filesystem::path& page, const EvaluationFiles& files,
                            std::uint64_t max_bytes) {
  std::string text = whole_text(page);
  erase_blocks(text);
  const std::size_t begin = text.find(kMapElement);
  const std::size_t end = text.find(kElementEnd, begin);
  if (begin == std::string::npos || end == std::string::npos) {
    throw std::runtime_error(page.string() + ": is no page with a map in it");
  }
  const std::size_t json = begin + kMapElement.size();
  Json map = Json::parse(text.substr(json, end - json), nullptr, false);
  if (map.is_discarded()) throw std::runtime_error(page.string() + ": its map is damaged");
  std::set<std::string> there;
  std::string data = block_elements(files.blocks, false, max_bytes, there);
  Json evaluation = Json::parse(files.json);
  const std::uint64_t left_out = leave_absent_nodes_out(evaluation["layers"], there);
  evaluation["evaluation"]["points_left_out"] = left_out;
  insert_evaluation(map, std::move(evaluation));
  data += map_element(map);
  text.replace(begin, end + kElementEnd.size() - begin, data);
  std::filesystem::path aside = page;
  aside += ".new";
  write_page_file(aside, text);
  std::filesystem::rename(aside, page);
}

}  // namespace unimapper::apps
