// Earlier places: recognising keyframes of another day's run.
#include <cmath>
#include <cstdio>
#include <unimapper/onboard/owned_pipeline.hpp>
#include <vector>

using namespace unimapper;

struct StoredPlace {  // keep it in a file between two runs
  std::vector<Keypoint> keypoints;
  std::vector<PlanePatch> planes;
  Pose T_odometry_keyframe;
};

/// Runs one keyframe among 40 walls, `shift` metres along; `before` is known from another day.
StoredPlace drive(const std::vector<StoredPlace>& before, float shift) {
  OwnedPipeline pipeline(preset(SensorKind::kOs1_64));
  for (std::uint32_t k = 0; k < before.size(); ++k)  // sessions from 1: the pipeline's own are 0
    pipeline->places().insert({before[k].keypoints, before[k].planes}, {1, k},
                              before[k].T_odometry_keyframe);
  std::vector<float> scan;  // x y z x y z ...
  for (int i = 0; i < 8400; ++i) {
    const int wall = i / 210;
    const float along = 0.2F * (i % 21) - 2, range = 8 + 0.9F * wall;
    const float x = range * std::sin(2.4F * wall) + along * std::cos(1.7F * wall);
    const float y = range * std::cos(2.4F * wall) + along * std::sin(1.7F * wall);
    scan.insert(scan.end(), {x - shift, y, 0.3F * (i / 21 % 10) - 1});
  }
  for (std::int64_t k = 0; k < 10; ++k)
    (void)pipeline->add_scan(PointView::xyz(scan.data(), 8400, 12), Pose{}, k + 1);
  const KeyframeView& keyframe = pipeline->keyframe();
  for (const LoopCandidate& loop : keyframe.loops)
    std::printf("session %u keyframe %u: %.2f m away, confidence %.2f\n", loop.match.session,
                loop.match.keyframe, loop.T_match_query.translation.norm(), loop.confidence);
  return {{keyframe.place.keypoints.begin(), keyframe.place.keypoints.end()},
          {keyframe.place.planes.begin(), keyframe.place.planes.end()},
          keyframe.T_odometry_keyframe};
}

int main() { (void)drive({drive({}, 0.0F)}, 2.0F); }
