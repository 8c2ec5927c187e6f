#include "src/apps/view/page_parts.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

#include "src/apps/picture/image.hpp"

namespace unimapper::apps {
namespace {

/// Coarse points come before fine ones; keyframes have a part of the page of their own.
std::vector<std::pair<std::string, std::uint64_t>> by_worth(const BlockList& blocks,
                                                            bool keyframes) {
  std::vector<std::pair<std::string, std::uint64_t>> names;  // with the bytes of the block
  for (const auto& entry : blocks.sizes()) {
    if (entry.first.starts_with("keyframe") == keyframes) names.push_back(entry);
  }
  const auto level = [](const auto& entry) { return entry.first.size() - entry.first.find('/'); };
  std::stable_sort(names.begin(), names.end(),
                   [&](const auto& a, const auto& b) { return level(a) < level(b); });
  return names;
}

}  // namespace

std::string block_element(const std::string& name) {
  return "<script type=\"application/octet-stream\" data-encoding=\"gzip+base64\" id=\"points/" +
         name;
}

std::string block_elements(const BlockList& blocks, bool keyframes, std::uint64_t max_bytes,
                           std::set<std::string>& there) {
  std::string data;
  for (const auto& [name, bytes] : by_worth(blocks, keyframes)) {
    const std::string start = block_element(name) + "\">";
    const std::uint64_t text_bytes = (bytes + 2) / 3 * 4;  // base64
    if (data.size() + start.size() + text_bytes + kElementEnd.size() > max_bytes) continue;
    data.append(start).append(base64_text(*blocks.read(name))).append(kElementEnd);
    there.insert(name);
  }
  return data;
}

std::string map_element(const nlohmann::ordered_json& map) {
  std::string text = map.dump();
  for (std::size_t at = 0; (at = text.find("</", at)) != std::string::npos; at += 3) {
    text.replace(at, 2, "<\\/");
  }
  return std::string(kMapElement).append(text).append(kElementEnd);
}

std::uint64_t leave_absent_nodes_out(nlohmann::ordered_json& layers,
                                     const std::set<std::string>& there) {
  std::uint64_t left_out = 0;
  for (auto& [name, layer] : layers.items()) {
    nlohmann::ordered_json kept = nlohmann::ordered_json::array();
    for (auto& node : layer["nodes"]) {
      if (there.count(name + "/" + node[0].get<std::string>()) > 0) {
        kept.push_back(std::move(node));
      } else {
        left_out += node[1].get<std::uint64_t>();
      }
    }
    layer["nodes"] = std::move(kept);
  }
  return left_out;
}

std::string base64_text(const std::string& bytes) {
  return base64({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

std::filesystem::path block_file(std::string name) {
  const std::size_t folder = name.find('/');
  const std::size_t second = name.find('/', folder + 1);
  if (second != std::string::npos) name[second] = '-';
  return name + ".gz";
}

void write_page_file(const std::filesystem::path& path, const std::string& content) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << content;
  out.close();
  if (!out) throw std::runtime_error(path.string() + ": cannot be written (disk full?)");
}

void write_blocks(const std::filesystem::path& folder, const BlockList& blocks) {
  for (const auto& [name, bytes] : blocks.sizes()) {
    write_page_file(folder / block_file(name), *blocks.read(name));
  }
}

}  // namespace unimapper::apps
