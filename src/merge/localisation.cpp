// Localisation keyframe by keyframe: gathering loops, accepting a first position, following it.
#include "unimapper/merge/localisation.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <utility>

#include "keyframe_clouds.hpp"
#include "localisation_filter.hpp"
#include "loop_acceptance.hpp"
#include "loop_search.hpp"
#include "loop_verifier.hpp"
#include "placement_check.hpp"
#include "seen_extent.hpp"
#include "session_path.hpp"

namespace unimapper::merge {
namespace {

// The robot's keyframes that are kept, and as many as go at once.
constexpr std::size_t kRememberedKeyframes = 400;
constexpr std::size_t kForgottenAtOnce = 200;
// Loops that a first position may rest on lie within so much path.
constexpr double kWindow_m = 300.0;
constexpr std::size_t kMostLoops = 150;
// A position less sure than this is none.
constexpr double kMostSigma_m = 5.0;
// No robot drives faster: odometry jumped, or somebody else drives.
constexpr double kMostSpeed_m_s = 60.0;
constexpr double kJump_m = 5.0;
// The map's own errors, which no number of loops averages out.
constexpr double kMapSigma_m = 0.1;
constexpr double kMapSigma_rad = 0.003;
// Two sets of loops that place the robot farther apart contradict each other.
constexpr double kApart_m = 3.0;
constexpr std::size_t kContradictingLoops = 2;

const std::string kTooFewLoops = "no loop to the map yet";

UncertainPose with_map_errors(UncertainPose at) {
  at.covariance.diagonal().head<3>().array() += kMapSigma_m * kMapSigma_m;
  at.covariance.diagonal().tail<3>().array() += kMapSigma_rad * kMapSigma_rad;
  return at;
}

std::int64_t reference_stamp_ns(const KeyframeRecord& keyframe) {
  return keyframe.scans.empty() ? 0 : keyframe.scans[keyframe.reference_scan].stamp_ns;
}

}  // namespace

const char* state_name(LocalisationState state) {
  switch (state) {
    case LocalisationState::kNotYet:
      return "not yet";
    case LocalisationState::kAmbiguous:
      return "ambiguous";
    case LocalisationState::kLocalised:
      return "localised";
  }
  return "";
}

class Localiser::State {
 public:
  State(std::vector<SessionData> sessions, const MergeResult& result, const MergeConfig& config)
      : config_(config),
        sessions_(take_map(std::move(sessions), result)),
        search_(sessions_, config_.loops),
        robot_(sessions_.size()) {
    for (const SessionData& session : sessions_) extents_.push_back(seen_extent_m(session));
    sessions_.emplace_back();
    clouds_ = std::make_unique<KeyframeClouds>(sessions_, config_.registration, config_.threads);
    loops_.resize(robot_);
    asked_.assign(robot_, 0);
  }

  MapPose add(KeyframeRecord keyframe) {
    check(keyframe);
    if (jumps_to(keyframe)) lose("odometry jumped", true);
    if (!robot().empty()) travelled_m_ += step_to(keyframe).norm();
    robot().push_back(std::move(keyframe));
    forget_old();
    path_ = SessionPath(robot_poses(), config_.odometry);
    take(verified_loops());
    give_up_if_unsure();
    return answer();
  }

 private:
  /// The sessions that are in the map; their paths are in the map frame.
  std::vector<SessionData> take_map(std::vector<SessionData> sessions, const MergeResult& result) {
    if (const Error wrong = config_.validate(); wrong.code != ErrorCode::kOk) {
      throw std::invalid_argument(wrong.message);
    }
    if (sessions.size() != result.sessions.size()) {
      throw std::invalid_argument("the poses are of other sessions");
    }
    std::vector<SessionData> map;
    for (std::size_t s = 0; s < sessions.size(); ++s) {
      const MergedSession& merged = result.sessions[s];
      if (!is_in_map(merged.status) || sessions[s].keyframes.empty()) continue;
      if (merged.T_map_keyframe.size() != sessions[s].keyframes.size()) {
        throw std::invalid_argument("the poses are of other sessions");
      }
      map.push_back(std::move(sessions[s]));
      map_paths_.emplace_back(merged.T_map_keyframe, config_.odometry);
    }
    if (map.empty()) throw std::invalid_argument("no session is in the map");
    return map;
  }

  [[nodiscard]] std::vector<KeyframeRecord>& robot() { return sessions_[robot_].keyframes; }
  [[nodiscard]] const std::vector<KeyframeRecord>& robot() const {
    return sessions_[robot_].keyframes;
  }
  [[nodiscard]] std::size_t newest() const { return robot().size() - 1; }

  [[nodiscard]] std::vector<Pose> robot_poses() const {
    std::vector<Pose> poses;
    for (const KeyframeRecord& k : robot()) poses.push_back(k.T_odometry_keyframe);
    return poses;
  }

  void check(const KeyframeRecord& keyframe) const {
    if (!keyframe.T_odometry_keyframe.is_rigid()) {
      throw std::invalid_argument("the keyframe's pose is no rigid transform");
    }
    if (!keyframe.scans.empty() && keyframe.reference_scan >= keyframe.scans.size()) {
      throw std::invalid_argument("the keyframe has no reference scan");
    }
    if (!robot().empty() && keyframe.sequence <= robot().back().sequence) {
      throw std::invalid_argument("the keyframe does not follow the one before");
    }
  }

  [[nodiscard]] Eigen::Vector3d step_to(const KeyframeRecord& next) const {
    return next.T_odometry_keyframe.translation - robot().back().T_odometry_keyframe.translation;
  }

  [[nodiscard]] bool jumps_to(const KeyframeRecord& next) const {
    if (robot().empty()) return false;
    const auto elapsed_ns =
        static_cast<double>(reference_stamp_ns(next) - reference_stamp_ns(robot().back()));
    const double farthest = kMostSpeed_m_s * std::max(0.0, 1e-9 * elapsed_ns);
    return step_to(next).norm() > std::max(kJump_m, farthest);
  }

  /// Loses the position. `forgets`: odometry does not tie what comes to what was.
  void lose(const std::string& reason, bool forgets) {
    if (filter_) ++times_lost_;
    filter_.reset();
    supporting_ = 0;
    state_ = LocalisationState::kNotYet;
    reason_ = reason;
    for (auto& of_session : loops_) of_session.clear();
    asked_.assign(robot_, 0);
    if (!forgets) {
      for (const LoopConstraint& loop : contradicting_) loops_[loop.match.session].push_back(loop);
    } else {
      forget_first(robot().size());
    }
    contradicting_.clear();
  }

  void forget_old() {
    if (robot().size() > kRememberedKeyframes) forget_first(kForgottenAtOnce);
  }

  void forget_first(std::size_t count) {
    if (filter_ && filter_->keyframe() < count) {
      filter_->start(count, filter_->predict(count, path_));
    }
    robot().erase(robot().begin(), robot().begin() + static_cast<std::ptrdiff_t>(count));
    clouds_->forget_first(robot_, count);
    const auto shift = [count](std::vector<LoopConstraint>& loops) {
      std::erase_if(loops, [&](const auto& loop) { return loop.query.keyframe < count; });
      for (LoopConstraint& loop : loops) {
        loop.query = {loop.query.session, loop.query.keyframe - count};
      }
    };
    for (auto& of_session : loops_) shift(of_session);
    shift(contradicting_);
  }

  [[nodiscard]] std::vector<LoopConstraint> verified_loops() {
    const auto candidates = search_.search(robot(), {robot_, newest()});
    auto loops =
        verify_loops(candidates, {config_.loops.max_correction_m, config_.loops.max_correction_rad},
                     *clouds_, config_);
    std::erase_if(loops, [](const LoopConstraint& loop) { return !loop.decision.accepted; });
    return loops;
  }

  void take(std::vector<LoopConstraint> loops) {
    if (loops.empty()) return;
    if (filter_) return follow(loops);
    for (LoopConstraint& loop : loops) loops_[loop.match.session].push_back(std::move(loop));
    for (auto& of_session : loops_) keep_window(of_session);
    begin();
  }

  void keep_window(std::vector<LoopConstraint>& loops) const {
    const double from = path_.length_m() - kWindow_m;
    std::erase_if(loops, [&](const auto& l) { return path_.path_m(l.query.keyframe) < from; });
    if (loops.size() <= kMostLoops) return;
    loops.erase(loops.begin(), loops.end() - static_cast<std::ptrdiff_t>(kMostLoops));
  }

  [[nodiscard]] UncertainPose measured(const LoopConstraint& loop) const {
    return pose_by_loop(map_paths_[loop.match.session][loop.match.keyframe], loop);
  }

  /// Loops that agree with the position correct it; two others in a row take it away.
  void follow(const std::vector<LoopConstraint>& loops) {
    const UncertainPose expected = with_map_errors(filter_->predict(newest(), path_));
    const LoopConstraint* best = nullptr;
    for (const LoopConstraint& loop : loops) {
      if (distance_chi2(expected, measured(loop)) > config_.acceptance.loop_chi2) continue;
      if (best == nullptr || loop.overlap > best->overlap) best = &loop;
    }
    if (best != nullptr) {
      contradicting_.clear();
      return correct(*best);
    }
    contradicting_.insert(contradicting_.end(), loops.begin(), loops.end());
    const auto apart_m =
        path_.path_m(newest()) - path_.path_m(contradicting_.front().query.keyframe);
    if (contradicting_.size() < kContradictingLoops || apart_m < distinct_m()) return;
    lose("loops contradict the position", false);
  }

  [[nodiscard]] double distinct_m() const { return rules(0).distinct_m; }

  /// Keyframes at one place err alike, so only one of them counts.
  void correct(const LoopConstraint& loop) {
    const std::size_t k = loop.query.keyframe;
    if (path_.path_m(k) - path_.path_m(filter_->keyframe()) < distinct_m()) return;
    filter_->correct(k, measured(loop), path_);
    last_loop_m_ = travelled_m_;
    ++supporting_;
  }

  [[nodiscard]] AcceptanceConfig rules(std::size_t session) const {
    const double own = seen_extent_m(sessions_[robot_]);
    const double of_map = extents_[session];
    return scaled_to_extent(config_.acceptance,
                            own > 0.0 && of_map > 0.0 ? std::max(own, of_map) : 0.0);
  }

  /// Looks for a first position among the loops gathered so far.
  void begin() {
    std::vector<ConsistencySet> sets;
    for (std::size_t s = 0; s < robot_; ++s) {
      sets.push_back(inter_session_consistency(loops_[s], path_, map_paths_[s], rules(s)));
    }
    const auto best = std::max_element(sets.begin(), sets.end(), [](const auto& a, const auto& b) {
      return std::pair(a.state, a.distinct) < std::pair(b.state, b.distinct);
    });
    const auto session = static_cast<std::size_t>(best - sets.begin());
    reason_ = best->reason;
    state_ = best->state == PairState::kRefused ? LocalisationState::kNotYet
                                                : LocalisationState::kAmbiguous;
    if (best->state != PairState::kConfirmed) return;
    reason_ = contradiction_by_others(sets, session);
    if (reason_.empty()) reason_ = reason_to_wait(session, *best);
    if (reason_.empty()) start(session, *best);
  }

  /// Another session of the map would place the robot elsewhere.
  [[nodiscard]] std::string contradiction_by_others(const std::vector<ConsistencySet>& sets,
                                                    std::size_t session) const {
    const auto place = [&](const ConsistencySet& set) -> Eigen::Vector3d {
      return (set.T_match_session_query_session * path_[newest()]).translation;
    };
    for (std::size_t s = 0; s < sets.size(); ++s) {
      const bool competes = s != session && sets[s].distinct >= 2 &&
                            static_cast<double>(sets[session].distinct) <
                                config_.acceptance.margin * static_cast<double>(sets[s].distinct);
      if (competes && (place(sets[s]) - place(sets[session])).norm() > kApart_m) {
        return "ambiguous: sessions of the map place the robot apart";
      }
    }
    return {};
  }

  /// What the sensor data say; not asked again before the set has grown.
  [[nodiscard]] std::string reason_to_wait(std::size_t session, const ConsistencySet& set) {
    if (set.distinct <= asked_[session]) return waits_for_;
    asked_[session] = set.distinct;
    std::vector<LoopConstraint> loops;
    for (const std::size_t i : set.inliers) loops.push_back(loops_[session][i]);
    PlacementEvaluator evaluator(sessions_, *clouds_, config_);
    const PlacementEvidence evidence = evaluator.evaluate(
        {loops, path_.poses(), map_paths_[session].poses(), set.T_match_session_query_session});
    waits_for_ = evidence.aliasing;
    if (waits_for_.empty() && evidence.contradicting > evidence.supporting) {
      waits_for_ = "keyframes beside each other see different structure";
    }
    if (waits_for_.empty() && set.is_one_place &&
        evidence.supporting < config_.acceptance.min_loops) {
      waits_for_ = "all loops lie in one place, and nothing confirms them elsewhere";
    }
    return waits_for_;
  }

  void start(std::size_t session, const ConsistencySet& set) {
    std::vector<LoopConstraint> loops;
    for (const std::size_t i : set.inliers) loops.push_back(loops_[session][i]);
    std::stable_sort(loops.begin(), loops.end(), [](const auto& a, const auto& b) {
      return a.query.keyframe < b.query.keyframe;
    });
    state_ = LocalisationState::kLocalised;
    filter_.emplace();
    filter_->start(loops.front().query.keyframe, measured(loops.front()));
    supporting_ = 1;
    for (const LoopConstraint& loop : loops) correct(loop);
    const std::size_t last = filter_->keyframe();
    last_loop_m_ = travelled_m_ - (path_.length_m() - path_.path_m(last));
    for (auto& of_session : loops_) of_session.clear();
  }

  [[nodiscard]] UncertainPose position() const {
    return with_map_errors(filter_->predict(newest(), path_));
  }

  void give_up_if_unsure() {
    if (!filter_) return;
    const Eigen::Matrix3d covariance = position().covariance.topLeftCorner<3, 3>();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance, Eigen::EigenvaluesOnly);
    if (axes.eigenvalues().maxCoeff() <= kMostSigma_m * kMostSigma_m) return;
    lose("too far by odometry alone", false);
  }

  [[nodiscard]] MapPose answer() const {
    MapPose at;
    at.state = state_;
    at.reason = reason_;
    at.path_m = travelled_m_;
    at.times_lost = times_lost_;
    if (!filter_) return at;
    const UncertainPose found = position();
    at.T_map_keyframe = found.pose;
    at.T_map_odometry = found.pose * robot().back().T_odometry_keyframe.inverse();
    at.covariance = found.covariance;
    at.loops = supporting_;
    at.since_loop_m = travelled_m_ - last_loop_m_;
    return at;
  }

  MergeConfig config_;
  std::vector<SessionPath> map_paths_;  // by session of the map, map frame
  std::vector<SessionData> sessions_;   // those of the map, then the robot's
  PlaceSearch search_;
  std::size_t robot_;  // index of the robot's session
  std::vector<double> extents_;
  std::unique_ptr<KeyframeClouds> clouds_;

  SessionPath path_;                                // the robot's, odometry frame
  std::vector<std::vector<LoopConstraint>> loops_;  // by session, until there is a position
  std::vector<std::size_t> asked_;                  // size of the set that sensor data refused
  std::string waits_for_;
  std::optional<MapPoseFilter> filter_;  // none: not localised
  std::vector<LoopConstraint> contradicting_;
  LocalisationState state_ = LocalisationState::kNotYet;
  std::string reason_ = kTooFewLoops;
  std::size_t supporting_ = 0;
  double travelled_m_ = 0.0;
  double last_loop_m_ = 0.0;
  std::uint32_t times_lost_ = 0;
};

Localiser::Localiser(std::vector<SessionData> sessions, const MergeResult& result,
                     const MergeConfig& config)
    : state_(std::make_unique<State>(std::move(sessions), result, config)) {}
Localiser::~Localiser() = default;
Localiser::Localiser(Localiser&&) noexcept = default;
Localiser& Localiser::operator=(Localiser&&) noexcept = default;

MapPose Localiser::add(KeyframeRecord keyframe) { return state_->add(std::move(keyframe)); }

}  // namespace unimapper::merge
