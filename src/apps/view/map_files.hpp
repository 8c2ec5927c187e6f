// A merged map as files of the page.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "src/apps/view/block_list.hpp"
#include "src/apps/view/view_source.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {

/// Everything that the page shows of a map that does not change.
struct MapFiles {
  std::string json;     ///< `api/map` (docs/api.md), the same for the same map
  std::string times{};  ///< what `api/map` has besides: times; empty: none
  BlockList blocks;     ///< gzip, by "static/r07" or "keyframe/2/31"
};

/// Of a whole merge. Keyframes are thinned, and few of them where there are many: those of loops.
/// Reads every keyframe once. The blocks are where the points of the map are, in memory or in a
/// file.
[[nodiscard]] MapFiles map_files(const std::string& title, const std::vector<SessionData>& sessions,
                                 const merge::MergeResult& result, float voxel_m);

/// Folder of a map with these files.
inline constexpr const char* kViewFolder = "view";

/// Writes map.json, times.json and blocks as LAYER/KEY.gz and keyframe/SESSION-KEYFRAME.gz. Throws
/// std::runtime_error naming the file that cannot be written.
void write_map_files(const std::filesystem::path& folder, const MapFiles& files);

/// What the page shows beside a map.
struct PageExtras {
  std::string report;   ///< HTML, escaped already; empty: none
  std::string picture;  ///< SVG, shown where a browser draws no map; empty: none
};

/// The page with a map in it, which opens from disk without a network: of the points as many as
/// `max_bytes` of text allow, the coarse ones first.
[[nodiscard]] std::string page_with(const MapFiles& files, std::uint64_t max_bytes,
                                    const PageExtras& extras = {});

/// The page without a map.
[[nodiscard]] std::string empty_page();

/// Shows a folder that `write_map_files` wrote. Thread safe.
class FolderView : public ViewSource {
 public:
  /// Throws std::runtime_error in words if it is none.
  explicit FolderView(std::filesystem::path folder);

  [[nodiscard]] std::shared_ptr<const std::string> map_json(std::int64_t /*epoch*/) override {
    return json_;
  }
  [[nodiscard]] std::optional<std::string> block(const std::string& version,
                                                 const std::string& layer,
                                                 const std::string& key) override;
  [[nodiscard]] std::optional<std::string> keyframe(const std::string& version, std::size_t session,
                                                    std::size_t keyframe) override;

 private:
  std::filesystem::path folder_;
  std::shared_ptr<const std::string> json_;
};

}  // namespace unimapper::apps
