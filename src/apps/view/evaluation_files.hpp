// Evaluation of a map as files of the page.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "src/apps/view/block_list.hpp"
#include "src/apps/view/map_view.hpp"

namespace unimapper::apps {

/// File of an evaluation beside map.json.
inline constexpr const char* kEvaluationFile = "evaluation.json";
/// Layers of points with the wrong label.
inline constexpr const char* kFalseStatic = "false_static";
inline constexpr const char* kFalseDynamic = "false_dynamic";

/// What an evaluation found, and where.
struct EvaluationFiles {
  std::string json;  ///< content of evaluation.json (docs/api.md)
  BlockList blocks;  ///< gzip, by "false_static/r07"
};

/// `evaluation` as docs/api.md has it; `layers`: `kFalseStatic` and `kFalseDynamic`.
[[nodiscard]] EvaluationFiles evaluation_files(const nlohmann::ordered_json& evaluation,
                                               const Layers& layers);

/// Writes evaluation.json and blocks beside map.json; what an earlier evaluation wrote is removed.
/// Throws std::runtime_error naming the file that cannot be written.
void write_evaluation_files(const std::filesystem::path& folder, const EvaluationFiles& files);

/// map.json with the evaluation in it. Points get another version, so that nobody takes those of an
/// earlier evaluation for them. Throws std::runtime_error, naming `file`, where `evaluation` is
/// none.
[[nodiscard]] std::string with_evaluation(const std::string& map, const std::string& evaluation,
                                          const std::string& file);

/// Puts the evaluation into a page that `page_with` made, in position of an earlier one, with
/// points to `max_bytes` of text. Throws std::runtime_error where `page` is none or cannot be
/// written; it is as before then.
void add_evaluation_to_page(const std::filesystem::path& page, const EvaluationFiles& files,
                            std::uint64_t max_bytes);

}  // namespace unimapper::apps
