// Parts of a page that holds a map, and files of a folder with one.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <string_view>

#include "src/apps/view/block_list.hpp"

namespace unimapper::apps {

/// What the element of the map begins with.
inline constexpr std::string_view kMapElement =
    "<script type=\"application/json\" id=\"map-json\">";
/// What every script element ends with.
inline constexpr std::string_view kElementEnd = "</script>\n";

/// What the element of a block begins with.
[[nodiscard]] std::string block_element(const std::string& name);

/// Elements of blocks, coarse points before fine ones: as many as `max_bytes` of text allow. Of
/// layers, or of keyframes. Adds the names of those that are in it to `there`.
[[nodiscard]] std::string block_elements(const BlockList& blocks, bool keyframes,
                                         std::uint64_t max_bytes, std::set<std::string>& there);

/// The element of a map; within it nothing looks like its end.
[[nodiscard]] std::string map_element(const nlohmann::ordered_json& map);

/// Leaves nodes whose block is not `there` out of `layers`; how many points that are.
std::uint64_t leave_absent_nodes_out(nlohmann::ordered_json& layers,
                                     const std::set<std::string>& there);

/// Bytes as base64.
[[nodiscard]] std::string base64_text(const std::string& bytes);

/// "static/r07" is in a file of that folder, "keyframe/2/31" in keyframe/2-31.gz.
[[nodiscard]] std::filesystem::path block_file(std::string name);

/// Makes the folder, too. Throws std::runtime_error naming the file that cannot be written.
void write_page_file(const std::filesystem::path& path, const std::string& content);
void write_blocks(const std::filesystem::path& folder, const BlockList& blocks);

}  // namespace unimapper::apps
