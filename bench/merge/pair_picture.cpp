#include "pair_picture.hpp"

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "ports/datasets/writers.hpp"
#include "src/apps/picture/palette.hpp"
#include "src/apps/picture/raster.hpp"

namespace unimapper::bench {
namespace {

constexpr std::size_t kPixels = 480;
constexpr double kFinestMetresPerPixel = 0.1;
constexpr double kPointM = 0.15;
constexpr double kKeyframeM = 0.6;

template <typename Visit>
void for_structure(const KeyframeRecord& keyframe, const Pose& T_map_keyframe, Visit visit) {
  for (const FineCell& cell : keyframe.static_cells) {
    if (cell.ground == 0) visit(T_map_keyframe * cell.position.cast<double>());
  }
}

}  // namespace

void write_pair_picture(const std::vector<SessionData>& sessions,
                        const std::array<std::vector<Pose>, 2>& T_map_keyframe,
                        const std::filesystem::path& file) {
  apps::Extent extent;
  for (std::size_t s = 0; s < 2; ++s) {
    for (std::size_t k = 0; k < sessions[s].keyframes.size(); ++k) {
      const Pose& pose = T_map_keyframe[s][k];
      extent.add_path(pose.translation.x(), pose.translation.y());
      for_structure(sessions[s].keyframes[k], pose,
                    [&](const Eigen::Vector3d& p) { extent.add_scenery(p.x(), p.y()); });
    }
  }
  const apps::Frame frame = extent.fit(kPixels, kFinestMetresPerPixel);
  apps::Layer structure(frame);
  apps::Layer keyframes(frame);
  for (std::size_t s = 0; s < 2; ++s) {
    for (std::size_t k = 0; k < sessions[s].keyframes.size(); ++k) {
      const Pose& pose = T_map_keyframe[s][k];
      keyframes.add(pose.translation.x(), pose.translation.y(), kKeyframeM, {1.0F, 1.0F, 1.0F});
      for_structure(sessions[s].keyframes[k], pose, [&](const Eigen::Vector3d& p) {
        structure.add(p.x(), p.y(), kPointM, apps::session_color(s));
      });
    }
  }
  apps::Image image(frame.width, frame.height, apps::kPictureBackground);
  const float full = structure.quantile(0.9);
  for (std::size_t y = 0; y < frame.height; ++y) {
    for (std::size_t x = 0; x < frame.width; ++x) {
      const std::size_t pixel = y * frame.width + x;
      const float amount = structure.amount(pixel);
      if (amount > 0.0F) {
        image.at(x, y) =
            mix(image.at(x, y), structure.color(pixel), std::min(1.0F, 0.2F + amount / full));
      }
      if (keyframes.amount(pixel) > 0.0F) image.at(x, y) = keyframes.color(pixel);
    }
  }
  const std::vector<std::uint8_t> png = encode_png(image);
  datasets::write_text(file,
                       std::string_view(reinterpret_cast<const char*>(png.data()), png.size()));
}

}  // namespace unimapper::bench
