// Steps of an odometry that the scans contradict
#include "src/input/odometry_breaks.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <span>

#include "src/core/cabin.hpp"
#include "src/core/quantile.hpp"
#include "src/input/agreement.hpp"
#include "src/input/plane_look.hpp"
#include "src/input/pose_noise.hpp"
#include "src/input/shut_in.hpp"
#include "src/input/text.hpp"

namespace unimapper::input {
namespace {

constexpr double kOff_m = 0.3;
constexpr double kOff_deg = 3.0;
// Agreement, against what pairs of scans usually have.
constexpr double kWell = 0.8;
constexpr double kFairly = 0.65;
constexpr double kElsewhere = 0.5;
constexpr std::size_t kPoints = 900;  // of a scan
// First looks: points on planes, against what is usual, and that show the least known direction.
constexpr double kOnPlanes = 0.85;
constexpr float kShown = 1.0F;
constexpr std::size_t kUsualPairs = 15;
constexpr std::size_t kFewestUsual = 4;
// Agreement, against that of the given motion.
constexpr double kBetter = 0.1;
constexpr double kOddBetter = 0.07;     // of a step that is unusual by itself, without much noise
constexpr double kLittleBetter = 0.04;  // twice in a row
constexpr double kAsWell = 0.03;
// Smallest over largest eigenvalue of the translation's information: tunnels have no more.
constexpr double kSlides = 0.03;

double angle_deg(const Pose& pose) { return rotation_angle(pose.rotation) * kDegreesPerRadian; }

bool is_off(const Pose& correction, double off_deg) {
  return correction.translation.norm() > kOff_m || angle_deg(correction) > off_deg;
}

/// What two scans say of the motion between them.
struct Step {
  bool is_told = false;  ///< they show walls, and are not within a cabin
  bool is_contradicted = false;
  bool is_elsewhere = false;
  bool is_doubtful = false;  ///< contradicted if the step before it is doubtful, too
  Pose correction;           ///< from the given motion to the one that the scans show
};

/// Of the last pairs.
class LastFew {
 public:
  void add(double value) {
    values_.push_back(value);
    if (values_.size() > kUsualPairs) values_.erase(values_.begin());
  }
  [[nodiscard]] bool is_known() const { return values_.size() >= kFewestUsual; }
  [[nodiscard]] double middle() const {
    std::vector<double> values = values_;
    return median(std::span(values));
  }

 private:
  std::vector<double> values_;
};

/// What pairs of scans usually have.
struct Usual {
  LastFew agreements;  ///< of pairs that were looked at closely
  LastFew shares;      ///< of points on planes
};

class BreakSearch {
 public:
  BreakSearch(const Track& track, const std::function<void(std::size_t, datasets::Scan&)>& read)
      : track_(track), read_(read) {
    // Noise of both poses is no step that the robot did not make.
    constexpr double kSurely = 5.0;
    const double noise_deg = attitude_noise_deg(measure_pose_noise(track));
    off_deg_ = std::max(kOff_deg, kSurely * std::sqrt(2.0) * noise_deg);
  }

  OdometryBreaks run() {
    std::size_t checked = 0;
    for (std::size_t i = 1; i < track_.size && !is_hopeless(); ++i) {
      const bool is_odd = differs_from_those_beside(i, off_deg_);
      if (is_odd && checked + 1 < i) check(checked, i - 1);
      if (is_odd) checked = i - 1;
      if (!is_odd && !is_apart(checked, i) && i + 1 < track_.size) continue;
      check(checked, i);
      checked = i;
      views_.erase(views_.begin(), views_.lower_bound(checked));
      note_cabin(checked);
    }
    return std::move(found_);
  }

 private:
  /// Poses of another convention or of other scans: the rest would tell nothing new.
  [[nodiscard]] bool is_hopeless() const {
    constexpr std::size_t kFewest = 10;
    return found_.compared >= kFewest && 2 * found_.contradicted > found_.compared;
  }

  [[nodiscard]] Pose motion(std::size_t i, std::size_t j) const {
    return track_.pose(i).inverse() * track_.pose(j);
  }

  [[nodiscard]] double seconds(std::size_t i, std::size_t j) const {
    return static_cast<double>(track_.stamp_ns(j) - track_.stamp_ns(i)) * 1e-9;
  }

  [[nodiscard]] bool is_apart(std::size_t i, std::size_t j) const {
    constexpr std::size_t kMostScans = 5;
    constexpr double kApart_m = 3.0;
    constexpr double kApart_deg = 8.0;
    const Pose moved = motion(i, j);
    return j - i >= kMostScans || moved.translation.norm() >= kApart_m ||
           angle_deg(moved) >= kApart_deg;
  }

  /// As the step of the robot from scan `at` to the next would go on for that long.
  [[nodiscard]] std::optional<Pose> extrapolated(std::size_t at, double seconds_long) const {
    if (at + 1 >= track_.size) return std::nullopt;
    const double seconds_known = seconds(at, at + 1);
    if (!(seconds_known > 0.0) || !(seconds_long > 0.0)) return std::nullopt;
    const Pose step = motion(at, at + 1);
    const double times = seconds_long / seconds_known;
    Pose result;
    result.translation = times * step.translation;
    const Eigen::AngleAxisd turn(step.rotation);
    result.rotation = Eigen::AngleAxisd(times * turn.angle(), turn.axis()).toRotationMatrix();
    return result;
  }

  /// Whether the step to scan `i` is far from what both steps beside it let expect.
  [[nodiscard]] bool differs_from_those_beside(std::size_t i, double off_deg) const {
    const Pose step = motion(i - 1, i);
    const double lasts_s = seconds(i - 1, i);
    bool differs = false;
    for (const std::size_t beside : {i - 2, i}) {
      if (beside != i && i < 2) continue;
      const std::optional<Pose> expected = extrapolated(beside, lasts_s);
      if (!expected) continue;
      if (!is_off(expected->inverse() * step, off_deg)) return false;
      differs = true;
    }
    return differs;
  }

  /// What one scan shows.
  struct View {
    std::optional<std::vector<Eigen::Vector3f>> points;
    std::shared_ptr<const ScanShape> shape;  ///< where the first look leaves a doubt
    bool is_shut_in = false;
  };

  const View& view(std::size_t i) {
    View& known = views_[i];
    if (!known.points) {
      read_(i, scan_);
      known.points = spread_points(scan_, PlaneLook::kPoints);
      known.is_shut_in = is_shut_in(scan_);
    }
    return known;
  }

  const std::shared_ptr<const ScanShape>& shape(std::size_t i) {
    View& known = views_[i];
    if (known.shape == nullptr) {
      read_(i, scan_);
      known.shape = std::make_shared<const ScanShape>(scan_, kPoints, leaf_m_);
      leaf_m_ = known.shape->next_leaf_m();
    }
    return known.shape;
  }

  /// Follows the robot into a closed cabin and out of it, where `i` is the last scan compared.
  void note_cabin(std::size_t i) {
    if (!view(i).is_shut_in) {
      if (last_open_ && first_shut_ && !is_room_) {
        const double rise_m =
            track_.pose(i).translation.z() - track_.pose(*last_open_).translation.z();
        // A lift may have moved the robot by storeys, and the odometry does not say so.
        if (is_unfelt_ride(seconds(*first_shut_, last_shut_), rise_m)) {
          add({*last_open_, i, 0.0, 0.0, false, true});
        }
      }
      last_open_ = i;
      first_shut_.reset();
      is_room_ = false;
      return;
    }
    if (!first_shut_) first_shut_ = i;
    last_shut_ = i;
  }

  /// What moves along with the robot says nothing of its motion; a room where it drives does.
  bool is_within_cabin(std::size_t i, std::size_t j) {
    if (!view(i).is_shut_in || !view(j).is_shut_in) return false;
    const std::size_t first = first_shut_.value_or(i);
    const Eigen::Vector3d driven = track_.pose(j).translation - track_.pose(first).translation;
    is_room_ = is_room_ || is_in_room(driven.head<2>().norm());
    return !is_room_;
  }

  /// `registers` also where the given motion agrees well.
  Step compare(std::size_t i, std::size_t j, bool registers = false) {
    const View& from = view(i);
    const View& to = view(j);
    const Pose given = motion(i, j);
    take_usual_of(is_standing(given));
    // Neighbours agree better than usual, even a metre off: a step that is unusual by itself is
    // always registered, but for poses that scatter.
    const bool is_odd =
        off_deg_ < 2.0 * kOff_deg && j == i + 1 && differs_from_those_beside(j, off_deg_);
    const bool suffices = !registers && !is_odd && usual_.agreements.is_known();
    const onboard::PlaneFit look = look_.fit(*from.points, *to.points, given);
    const auto share = static_cast<double>(look.share);
    Step step;
    if (suffices && !from.is_shut_in && !to.is_shut_in && look.least >= kShown &&
        usual_.shares.is_known() && share >= kOnPlanes * usual_.shares.middle()) {
      usual_.shares.add(share);
      step.is_told = true;
      return step;
    }
    const ScanPair pair(i, shape(i), j, shape(j));
    step.is_told = pair.is_informative() && !is_within_cabin(i, j);
    if (!step.is_told) return step;
    const bool is_door = from.is_shut_in != to.is_shut_in;
    const double usually = usual_.agreements.is_known() ? usual_.agreements.middle() : 1.0;
    // Few points agree less by chance, but still best where the scans belong.
    const auto is_right = [&](const Pose& motion, double agreement) {
      return suffices && (agreement >= kWell * usually ||
                          (agreement >= kFairly * usually && pair.is_peak(motion, agreement)));
    };
    const double agrees = pair.agreement(given);
    if (is_right(given, agrees)) {
      usual_.agreements.add(agrees);
      usual_.shares.add(share);
      return step;
    }
    double best = agrees;
    Pose shown = given;
    double condition = 1.0;
    for (const Pose& start : starts(i, j)) {
      if (!start.is_finite()) continue;
      const merge::RegistrationResult found = pair.registration(start);
      const double agreement = pair.agreement(found.T_target_source);
      if (agreement <= best) continue;
      best = agreement;
      shown = found.T_target_source;
      condition = found.condition;
      // Near to the given motion, and as well as usual: other starts would show no other one.
      if (!is_off(given.inverse() * shown, off_deg_) && is_right(shown, best)) break;
    }
    if (usual_.agreements.is_known() && best < kElsewhere * usually) {
      // A door that opens shows another place, too, and so does a way without poses.
      step.is_contradicted = step.is_elsewhere = !is_door && !goes_on(i, j);
      return step;
    }
    usual_.agreements.add(best);
    step.correction = given.inverse() * shown;
    // Rings of a sparse sensor agree with no motion at all: they say nothing of this one.
    const bool is_unmoved = pair.agreement(Pose()) >= best - kAsWell && !is_off(shown, off_deg_);
    // In a bore registration slides along it.
    const bool slides = condition < kSlides;
    const bool is_known = (!is_unmoved && !slides) || is_beyond_reach(i, j);
    step.is_doubtful =
        best >= agrees + kLittleBetter && is_off(step.correction, off_deg_) && is_known;
    if (!step.is_doubtful) usual_.shares.add(share);
    const double better = is_odd ? kOddBetter : kBetter;
    step.is_contradicted = step.is_doubtful && best >= agrees + better;
    return step;
  }

  /// Whether the given motion is one that both sides of it do not let expect.
  [[nodiscard]] bool is_beyond_reach(std::size_t i, std::size_t j) const {
    // Noise of the attitude adds up over the poses that are compared.
    return j == i + 1 && differs_from_those_beside(j, 2.0 * off_deg_);
  }

  /// Whether the robot drove too far between both scans for them to show the same place, as fast as
  /// it did before or after, or both: a gap in the poses.
  [[nodiscard]] bool goes_on(std::size_t i, std::size_t j) const {
    constexpr double kFar_m = 10.0;
    constexpr double kSlowest = 0.5;  // a curve is longer than its chord
    constexpr double kFastest = 1.5;
    const double given_m = motion(i, j).translation.norm();
    if (given_m < kFar_m) return false;
    double sum_m = 0.0;
    int known = 0;
    for (const std::size_t beside : {i - 1, j}) {
      const auto expected =
          beside == j || i > 0 ? extrapolated(beside, seconds(i, j)) : std::nullopt;
      if (!expected) continue;
      sum_m += expected->translation.norm();
      ++known;
    }
    return known * given_m > kSlowest * sum_m && known * given_m < kFastest * sum_m;
  }

  /// Where a registration may begin, no two next to each other: they would lead to one motion.
  [[nodiscard]] std::vector<Pose> starts(std::size_t i, std::size_t j) const {
    std::vector<Pose> poses = {motion(i, j)};
    const auto add = [&](const Pose& start) {
      const bool is_known = std::any_of(poses.begin(), poses.end(), [&](const Pose& other) {
        const Pose apart = other.inverse() * start;
        return apart.is_finite() && !is_off(apart, off_deg_);
      });
      if (!is_known) poses.push_back(start);
    };
    add(Pose());
    const double lasts_s = seconds(i, j);
    if (i > 0) {
      if (const auto before = extrapolated(i - 1, lasts_s)) add(*before);
    }
    if (const auto after = extrapolated(j, lasts_s)) add(*after);
    return poses;
  }

  void check(std::size_t i, std::size_t j) {
    ++found_.compared;
    const Step whole = compare(i, j, doubtful_in_a_row_ > 0);
    if (whole.is_told) found_.steps_told += j - i;
    if (whole.is_contradicted && add_single_steps(i, j, whole)) {
      ++found_.contradicted;
      doubtful_in_a_row_ = 0;
      return;
    }
    doubtful_in_a_row_ = whole.is_doubtful ? doubtful_in_a_row_ + 1 : 0;
    // An odometry that slips or drifts is off by less than a step's limit at each scan. Where the
    // poses stand still, once is enough.
    const bool stands = whole.is_contradicted && !is_off(motion(i, j), off_deg_);
    const bool slips = doubtful_in_a_row_ >= 2 || stands;
    if (doubtful_in_a_row_ >= 2 && !before_.is_added) {
      add_slip(before_.last, before_.next, before_.step);
    }
    if (slips) add_slip(i, j, whole);
    before_ = {i, j, whole, slips};
  }

  /// Whether most scans have the pose of the one before: even where a robot stands, an odometry
  /// scatters.
  [[nodiscard]] bool is_frozen(std::size_t i, std::size_t j) const {
    constexpr double kSame = 1e-6;  // m, rad
    std::size_t same = 0;
    for (std::size_t k = i + 1; k <= j; ++k) {
      const Pose step = motion(k - 1, k);
      same += step.translation.norm() < kSame && rotation_angle(step.rotation) < kSame ? 1 : 0;
    }
    return 2 * same > j - i;
  }

  void add_slip(std::size_t i, std::size_t j, const Step& step) {
    ++found_.contradicted;
    OdometryBreak slip = break_of(i, j, step);
    slip.is_slip = !slip.is_frozen;
    add(slip);
  }

  /// Adds the steps between both scans that are contradicted by themselves; whether there are any.
  bool add_single_steps(std::size_t i, std::size_t j, const Step& whole) {
    if (j == i + 1) {
      add(break_of(i, j, whole));
      return true;
    }
    bool is_found = false;
    for (std::size_t k = i + 1; k <= j; ++k) {
      const Step step = compare(k - 1, k);
      if (!step.is_contradicted) continue;
      is_found = true;
      add(break_of(k - 1, k, step));
    }
    return is_found;
  }

  [[nodiscard]] OdometryBreak break_of(std::size_t last, std::size_t next, const Step& step) const {
    OdometryBreak found{last, next, step.correction.translation.norm(), angle_deg(step.correction),
                        step.is_elsewhere};
    found.is_frozen = is_frozen(last, next);
    return found;
  }

  /// Steps that follow each other are one break, and so are those on the way into a cabin.
  void add(OdometryBreak found) {
    std::vector<OdometryBreak>& breaks = found_.breaks;
    while (!breaks.empty() && breaks.back().next >= found.last) {
      const OdometryBreak& before = breaks.back();
      found.last = std::min(found.last, before.last);
      found.off_m = std::max(found.off_m, before.off_m);
      found.off_deg = std::max(found.off_deg, before.off_deg);
      found.is_elsewhere = found.is_elsewhere || before.is_elsewhere;
      found.is_shut_in = found.is_shut_in || before.is_shut_in;
      found.is_slip = found.is_slip && before.is_slip;
      found.is_frozen = found.is_frozen || before.is_frozen;
      breaks.pop_back();
    }
    breaks.push_back(found);
  }

  static bool is_standing(const Pose& given) {
    constexpr double kStands_m = 0.1;
    constexpr double kStands_deg = 1.0;
    return given.translation.norm() < kStands_m && angle_deg(given) < kStands_deg;
  }

  /// Scans of a robot that stands agree better than is usual while it drives.
  void take_usual_of(bool stands) {
    if (stands == stands_) return;
    if (stands) usual_driving_ = usual_;
    if (!stands) usual_ = usual_driving_;
    stands_ = stands;
  }

  const Track& track_;
  const std::function<void(std::size_t, datasets::Scan&)>& read_;
  double off_deg_ = kOff_deg;  ///< from which a motion is another one
  datasets::Scan scan_;
  std::map<std::size_t, View> views_;
  float leaf_m_ = ScanShape::kLeaf_m;  ///< of the next view
  PlaneLook look_;
  Usual usual_;
  Usual usual_driving_;  ///< before the robot stood
  bool stands_ = false;
  // Of the scans compared: the last one that saw more than a cabin, and those that are shut in
  // since.
  std::optional<std::size_t> last_open_;
  std::optional<std::size_t> first_shut_;
  std::size_t last_shut_ = 0;
  bool is_room_ = false;  ///< the robot drove since it was shut in
  /// The scans compared last.
  struct Compared {
    std::size_t last = 0;
    std::size_t next = 0;
    Step step;
    bool is_added = false;
  };
  Compared before_;
  int doubtful_in_a_row_ = 0;  ///< pairs of scans, up to the last one
  OdometryBreaks found_;
};

}  // namespace

OdometryBreaks find_odometry_breaks(const Track& track,
                                    const std::function<void(std::size_t, datasets::Scan&)>& read) {
  return BreakSearch(track, read).run();
}

std::string describe(const OdometryBreak& odometry_break) {
  const OdometryBreak& b = odometry_break;
  if (b.is_shut_in) {
    return text(
        "between scan %zu and %zu (counted from 0) the robot was shut in, as in a lift, and the "
        "odometry did not rise: it may have come out on another storey",
        b.last, b.next);
  }
  if (b.is_elsewhere) {
    return text(
        "the scans %zu and %zu (counted from 0) show different places, and the poses do not say so",
        b.last, b.next);
  }
  return text(
      "between scan %zu and %zu (counted from 0) %sposes and scans differ by %.2f m and %.1f "
      "degrees",
      b.last, b.next, b.is_frozen ? "one pose is repeated while the scans move, and " : "", b.off_m,
      b.off_deg);
}

Finding check_odometry_breaks(const OdometryBreaks& found) {
  constexpr double kMost = 0.25;
  Finding finding{"odometry",
                  Severity::kFine,
                  static_cast<double>(found.contradicted),
                  "steps",
                  {},
                  {0.0, kMost * static_cast<double>(found.compared)}};
  if (found.breaks.empty()) return finding;
  const bool is_wrong =
      static_cast<double>(found.contradicted) > kMost * static_cast<double>(found.compared);
  finding.severity = is_wrong ? Severity::kWrong : Severity::kSuspicious;
  std::string where;
  constexpr std::size_t kNamed = 10;
  for (std::size_t i = 0; i < std::min(found.breaks.size(), kNamed); ++i) {
    where += (i == 0 ? "" : "; ") + describe(found.breaks[i]);
  }
  if (found.breaks.size() > kNamed) where += "; ...";
  finding.message =
      is_wrong
          ? text(
                "the scans contradict the poses in %zu of %zu steps, first %s: the odometry stands "
                "still, slips or belongs to other scans; map the recording with another one",
                found.contradicted, found.compared, describe(found.breaks.front()).c_str())
          : "the odometry was started anew, jumped, slipped, or did not feel the robot move: " +
                where + "; what follows is a session of its own";
  return finding;
}

}  // namespace unimapper::input
