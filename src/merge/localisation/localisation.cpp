// Localisation keyframe by keyframe: a first position, then odometry and loops from there.
#include "unimapper/merge/localisation.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "first_position.hpp"
#include "localisation_filter.hpp"
#include "src/merge/loops/loop_search.hpp"
#include "src/merge/loops/loop_verifier.hpp"
#include "src/merge/registration/keyframe_clouds.hpp"
#include "src/merge/sessions/session_path.hpp"

namespace unimapper::merge {
namespace {

constexpr std::size_t kForgottenAtOnce = Localiser::kRememberedKeyframes / 2;
// A position less sure than this is none.
constexpr double kMostSigma_m = 5.0;
// No robot drives faster: odometry jumped, or somebody else drives.
constexpr double kMostSpeed_m_s = 60.0;
constexpr double kJump_m = 5.0;
// The map's own errors, which no number of loops averages out.
constexpr double kMapSigma_m = 0.1;
constexpr double kMapSigma_rad = 0.003;
constexpr std::size_t kContradictingLoops = 2;

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
        search_(sessions_, sessions_.size()),
        robot_(sessions_.size()) {
    sessions_.emplace_back();
    clouds_.emplace(sessions_, config_.registration, config_.threads);
    first_.emplace(sessions_, map_paths_, *clouds_, config_);
  }

  MapPose add(KeyframeRecord keyframe) {
    check(keyframe);
    if (jumps_to(keyframe)) lose("odometry jumped", true);
    if (!robot().empty()) travelled_m_ += step_to(keyframe).norm();
    robot().push_back(std::move(keyframe));
    forget_old();
    path_ = odometry_of(sessions_[robot_], config_.odometry);
    take(verified_loops());
    lose_if_unsure();
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
    first_->clear();
    if (forgets) forget_first(robot().size());
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
    first_->forget_first(count);
    forget_first_queries(contradicting_, count);
  }

  [[nodiscard]] std::vector<LoopConstraint> verified_loops() {
    const auto candidates = search_.search(sessions_[robot_], {robot_, newest()});
    auto loops = verify_loops(candidates, kDescriptorLimit, *clouds_, config_);
    std::erase_if(loops, [](const LoopConstraint& loop) { return !loop.decision.accepted; });
    return loops;
  }

  void take(std::vector<LoopConstraint> loops) {
    if (loops.empty()) return;
    if (filter_) {
      follow(std::move(loops));
    } else {
      look(std::move(loops));
    }
  }

  /// Looks for a first position.
  void look(std::vector<LoopConstraint> loops) {
    const FirstPosition::Outcome found = first_->find(std::move(loops), path_);
    state_ = found.state;
    reason_ = found.reason;
    if (state_ == LocalisationState::kLocalised) start(found);
  }

  [[nodiscard]] UncertainPose measured(const LoopConstraint& loop) const {
    return pose_by_loop(map_paths_[loop.match.session][loop.match.keyframe], loop);
  }

  /// Loops that agree with the position correct it; two others in a row take it away, and are the
  /// first to look for another one with.
  void follow(std::vector<LoopConstraint> loops) {
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
    if (contradicting_.size() < kContradictingLoops || apart_m < rules_.distinct_m) return;
    std::vector<LoopConstraint> others = std::move(contradicting_);
    const char* reason = "loops contradict the position";
    lose(reason, false);
    look(std::move(others));
    if (!filter_) reason_ = reason;
  }

  /// Keyframes at one place err alike, so only one of them counts.
  void correct(const LoopConstraint& loop) {
    const std::size_t k = loop.query.keyframe;
    if (path_.path_m(k) - path_.path_m(filter_->keyframe()) < rules_.distinct_m) return;
    filter_->correct(k, measured(loop), path_);
    last_loop_m_ = travelled_m_;
    ++supporting_;
  }

  void start(const FirstPosition::Outcome& found) {
    rules_ = found.rules;
    filter_.emplace();
    filter_->start(found.loops.front().query.keyframe, measured(found.loops.front()));
    supporting_ = 1;
    for (const LoopConstraint& loop : found.loops) correct(loop);
    last_loop_m_ = travelled_m_ - (path_.length_m() - path_.path_m(filter_->keyframe()));
  }

  [[nodiscard]] UncertainPose position() const {
    return with_map_errors(filter_->predict(newest(), path_));
  }

  void lose_if_unsure() {
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
  std::optional<KeyframeClouds> clouds_;
  std::optional<FirstPosition> first_;

  SessionPath path_;                     // the robot's, odometry frame
  AcceptanceConfig rules_;               // between the robot and the session that placed it
  std::optional<MapPoseFilter> filter_;  // none: not localised
  std::vector<LoopConstraint> contradicting_;
  LocalisationState state_ = LocalisationState::kNotYet;
  std::string reason_ = "no loop to the map yet";
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
