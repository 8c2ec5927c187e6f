// Synthetic merge result for tests of reports.
#pragma once

#include "src/apps/report.hpp"
#include "tests/random.hpp"
#include "tests/test.hpp"

namespace synthetic {

/// Numbers in [0, 1).
class Random : private unimapper::test::Random {
 public:
  using unimapper::test::Random::Random;
  float operator()() { return static_cast<float>(uniform()); }
};

struct Merge {
  std::vector<unimapper::SessionData> sessions;
  unimapper::merge::MergeResult result;
  unimapper::apps::ReportInput input;

  Merge() = default;
  Merge(const Merge&) = delete;  // `input` points into it
  Merge& operator=(const Merge&) = delete;
};

inline unimapper::Pose heading(double x, double y, double yaw) {
  return {Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix(), {x, y, 1.7}};
}

/// Where session `s` is after the share `t` of its way: loops around blocks of a town.
inline unimapper::Pose route(std::size_t s, double t) {
  const double w = 110.0 + 25.0 * static_cast<double>(s % 3);
  const double h = 70.0;
  const double x0 = 30.0 * static_cast<double>(s % 3);
  const double length = 2 * (w + h);
  const double d = std::fmod(1.15 * t * length, length);
  if (d < w) return heading(x0 + d, 0, 0);
  if (d < w + h) return heading(x0 + w, d - w, 0.5 * M_PI);
  if (d < 2 * w + h) return heading(x0 + w - (d - w - h), h, M_PI);
  return heading(x0, h - (d - 2 * w - h), -0.5 * M_PI);
}

inline void add_session(Merge& merge, std::size_t s, const char* name, const char* sensor,
                        std::uint32_t keyframes) {
  using namespace unimapper;
  SessionData session;
  session.info = {{static_cast<std::uint32_t>(s), 1}, name, sensor};
  session.complete = s != 1;
  session.keyframes_missing = s == 1 ? 3 : 0;
  merge::MergedSession merged;
  apps::SessionReference reference;
  for (std::uint32_t k = 0; k < keyframes; ++k) {
    const Pose truth = route(s, static_cast<double>(k) / keyframes);
    Pose estimate = truth;
    estimate.translation.x() += 0.12 * std::sin(0.11 * k + static_cast<double>(s));
    estimate.translation.y() += 0.10 * std::cos(0.07 * k);
    KeyframeRecord record;
    record.sequence = k;
    record.T_odometry_keyframe = estimate;
    record.scans = {{k * 10, static_cast<std::int64_t>(k) * 1'000'000'000, estimate}};
    record.points_in = 1'310'720;
    record.points_dynamic = 31'000 + 9'000 * s;
    merged.T_map_keyframe.push_back(estimate);
    reference.truth.push_back({record.scans[0].stamp_ns, truth});
    session.keyframes.push_back(std::move(record));
  }
  merged.status = s == 0 ? merge::SessionStatus::kCentral : merge::SessionStatus::kMerged;
  merge.sessions.push_back(std::move(session));
  merge.result.sessions.push_back(std::move(merged));
  merge.input.references.push_back(std::move(reference));
}

/// Two streets and the fronts of the houses along them. `step_m` decides how many points.
inline void add_town(Merge& merge, float step_m) {
  const auto add = [&](float x, float y, float z) {
    const auto session = x < 30 ? 0U : x > 140 ? 2U : 1U;
    const auto seen = x > 25 && x < 135 ? 2U : 1U;
    merge.result.map.push_back({{x, y, z}, session, seen & 0x7FFFFFU});
  };
  for (float x = -20; x < 215; x += step_m) {
    for (const float street : {0.0F, 70.0F}) {
      for (float y = -5; y < 5; y += step_m) add(x, street + y, 0);
      for (float z = 0; z < 6; z += step_m) {
        for (const float side : {-9.0F, 9.0F}) add(x, street + side, z);
      }
    }
  }
}

/// Three sessions that merged and one that did not, with loops, changes and moving things.
/// Filled where it is, because the input points into it.
inline void fill(Merge& merge, float step_m = 0.2F) {
  using namespace unimapper;
  add_session(merge, 0, "monday", "os2-128", 120);
  add_session(merge, 1, "wednesday", "livox-avia", 96);
  add_session(merge, 2, "friday", "vlp-16", 110);
  add_session(merge, 3, "elsewhere", "os1-64", 40);
  merge.result.sessions[3].status = merge::SessionStatus::kUnconnected;
  merge.result.sessions[3].reason = "2 loops found, 3 that agree are needed";
  Random random(9);
  for (KeyframeRecord& keyframe : merge.sessions[3].keyframes) {
    for (int i = 0; i < 400; ++i) {
      keyframe.static_cells.push_back(
          {{40 * random() - 20, (random() < 0.5F ? 8.0F : -8.0F), 5 * random() - 1.5F}, 9, 0, 0});
    }
  }
  add_town(merge, step_m);
  const auto loop = [&](std::size_t qs, std::size_t qk, std::size_t ms, std::size_t mk,
                        float confidence, bool accepted, const char* reason) {
    merge::LoopConstraint& added = merge.result.loops.emplace_back();
    added.query = {qs, qk};
    added.match = {ms, mk};
    added.confidence = confidence;
    added.decision = {accepted, reason};
    added.T_match_query = heading(1.5, -0.4, 0.2);
  };
  for (std::size_t k = 0; k < 30; ++k) {
    loop(1, 3 * k, 0, 3 * k + 20, 0.8F, true, k % 3 == 0 ? "descriptor" : "radius");
    loop(2, 3 * k, 0, 3 * k + 10, 0.7F, true, "radius");
    loop(2, 3 * k + 1, 1, 90 - 3 * k, 0.3F, false,
         k % 4 == 0 ? "outside the consistency set of its two sessions"
                    : "overlap 0.3 (limit 0.45)");
  }
  for (std::size_t k = 100; k < 118; ++k) loop(0, k, 0, k - 100, 0.9F, true, "descriptor");
  for (int i = 0; i < 9000; ++i) {
    const float t = random();
    const float side = random() < 0.5F ? 2.0F : -2.0F;
    merge.result.dynamic_points.push_back({10 + 90 * t, side + 1.6F * random(), random()});
    if (i % 3 == 0) {
      merge.result.dynamic_points.push_back({60 + random(), 70 * t, 1.7F * random()});
    }
  }
  for (int i = 0; i < 2400; ++i) {
    const auto spot = static_cast<float>(i % 12);
    merge.result.changes.push_back(
        {{12 + 13 * spot + 4 * random(), 4.2F + 1.8F * random(), random()}, 1, i % 12 < 7});
  }
  merge.result.timing = {{"intra-session loops", 3.21},
                         {"inter-session loops", 6.8},
                         {"final optimisation", 0.42},
                         {"map and changes", 4.9}};
  merge.input.sessions = &merge.sessions;
  merge.input.result = &merge.result;
  merge.input.title = "A little town <three> times";
  merge.input.elapsed_s = 15.4;
  merge.input.commands = {"unimapper merge monday wednesday friday elsewhere --out map"};
  const unimapper::apps::RemovalScore score{{1'000'000, 981'234, 50'000, 45'678},
                                            {1'000'000, 981'234, 40'000, 39'000}};
  for (auto& reference : merge.input.references) reference.removal = score;
}

}  // namespace synthetic
