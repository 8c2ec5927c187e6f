#include "src/apps/survey/survey_keyframes.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "src/apps/survey/visible_points.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"
#include "unimapper/wire/keyframe_codec.hpp"
#include "unimapper/wire/keyframe_encoder.hpp"

namespace unimapper::apps {
namespace {

constexpr std::int64_t kStepNs = 1000000000;

/// Configuration of a dense sensor which sees all round, without the removal of what moves.
PipelineConfig survey_config(float range_m) {
  PipelineConfig config = preset(SensorKind::kOs2_128);
  config.odometry.up_sigma_deg = 0.1F;
  config.keyframe.scans = 1;
  config.keyframe.range_min_m = 0.0F;
  config.keyframe.range_max_m = range_m;
  config.keyframe.max_pose_step_m = 1000.0F;
  config.keyframe.max_speed_mps = 1000.0F;
  config.keyframe.max_points_per_scan = 1U << 22U;
  config.voxel.max_cells = 1U << 20U;
  config.voxel.max_window_blocks = 1U << 19U;
  config.ground.align_noise_deg = 0.0F;
  config.ground.seen_through_share = 0.0F;
  config.ground.foot_height_m = 0.0F;
  config.free_space.own_keyframe = false;
  config.free_space.images_per_keyframe = 1;
  config.free_space.ray_spacing_deg = 0.0F;
  config.free_space.ring_spacing_deg = 0.0F;
  config.removal.window = 1;
  config.removal.log_odds_free = 0.0F;
  config.removal.components = false;
  config.removal.cluster_cells = 0;
  config.removal.final_labels = false;
  // Its own places are not searched here.
  config.loop_search.max_places = 16;
  return config;
}

class KeyframeMaker {
 public:
  KeyframeMaker(const SessionId& session, float range_m)
      : session_(session), config_(survey_config(range_m)), pipeline_(config_) {
    if (!pipeline_) throw std::runtime_error(pipeline_.error().message);
    memory_ = MemoryBlock(wire::KeyframeEncoder::required_bytes(config_.voxel.max_cells));
    const auto encoder = wire::KeyframeEncoder::create(config_.voxel.max_cells, memory_.span());
    if (!encoder.ok()) throw std::runtime_error(encoder.error().message);
    encoder_ = *encoder;
  }

  wire::ReceivedKeyframe make(const std::vector<Eigen::Vector3f>& points,
                              const Eigen::Vector3f& viewpoint, std::size_t number) {
    const Pose T_survey_sensor(Eigen::Matrix3d::Identity(), viewpoint.cast<double>());
    const auto view = PointView::xyz(points.data(), points.size(), sizeof(Eigen::Vector3f));
    const std::int64_t stamp_ns = static_cast<std::int64_t>(number) * kStepNs;
    ScanResult result = pipeline_->add_scan(view, T_survey_sensor, stamp_ns);
    // Parts of a survey may lie far apart. A second scan says that the first one was no glitch.
    if (result.error.code == ErrorCode::kPoseJump) {
      result = pipeline_->add_scan(view, T_survey_sensor, stamp_ns + 1);
    }
    if (!result.error.ok()) fail(number, result.error.message);
    if (!result.keyframe_finished) fail(number, "no keyframe");
    KeyframeContent keyframe = pipeline_->finished_keyframe();
    keyframe.images = {};
    wire::ReceivedKeyframe made;
    made.bytes.resize(encoder_.encode(keyframe, session_, {}).bytes);
    const wire::EncodeResult encoded = encoder_.encode(keyframe, session_, made.bytes);
    if (!encoded.error.ok()) fail(number, encoded.error.message);
    wire::DecodedKeyframe decoded = wire::decode_keyframe(made.bytes);
    if (!decoded.record) fail(number, decoded.error);
    made.record = std::move(*decoded.record);
    return made;
  }

 private:
  [[noreturn]] static void fail(std::size_t number, const std::string& why) {
    throw std::runtime_error("viewpoint " + std::to_string(number) + ": " + why);
  }

  SessionId session_;
  PipelineConfig config_;
  OwnedPipeline pipeline_;
  MemoryBlock memory_;
  wire::KeyframeEncoder encoder_;
};

}  // namespace

void make_survey_keyframes(const PointTiles& cloud, const SessionId& session,
                           const std::vector<Eigen::Vector3f>& viewpoints, float range_m,
                           const std::function<void(wire::ReceivedKeyframe&&)>& take) {
  KeyframeMaker maker(session, range_m);
  for (std::size_t i = 0; i < viewpoints.size(); ++i) {
    take(maker.make(visible_points(cloud, viewpoints[i], range_m), viewpoints[i], i));
  }
}

}  // namespace unimapper::apps
