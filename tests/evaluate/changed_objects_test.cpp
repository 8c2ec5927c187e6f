// Tests of precision and recall of changed objects.
#include "src/evaluate/changed_objects.hpp"

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::evaluate;

namespace {

constexpr int kCar = 10;
constexpr std::array kVehicles = {kCar, 18};

UprightBox car_at(double x, double y = 0.0) { return {{x, y, 0.7}, 0.0, {4.5, 1.8, 1.5}}; }

StandingObject parked(double x, int label = kCar) { return {label, car_at(x)}; }

/// True changes that both visits could see.
std::vector<TrueChange> observable(std::vector<TrueChange> changes) {
  for (TrueChange& change : changes) change.is_observable = true;
  return changes;
}

ChangeScore score(const std::vector<FoundChange>& found, const std::vector<TrueChange>& truth,
                  std::vector<bool> stood = {}) {
  stood.resize(found.size(), false);
  return score_changes(found, truth, stood, kVehicles);
}

}  // namespace

TEST_CASE("An upright box knows what lies in it, and what above", "[changes]") {
  const UprightBox box{{10.0, 20.0, 1.0}, 0.5, {4.0, 2.0, 1.0}};
  const auto at = [](double along, double across, double up) {
    return Eigen::Vector3d(10.0 + along * std::cos(0.5) - across * std::sin(0.5),
                           20.0 + along * std::sin(0.5) + across * std::cos(0.5), 1.0 + up);
  };
  CHECK(box.contains(at(1.9, 0.9, 0.4)));
  CHECK_FALSE(box.contains(at(2.1, 0.0, 0.0)));
  CHECK_FALSE(box.contains(at(0.0, 1.1, 0.0)));
  CHECK_FALSE(box.contains(at(0.0, 0.0, 0.6)));
  CHECK(box.contains(at(2.1, 1.1, 0.6), 0.2));
  CHECK(box.covers(at(1.9, 0.9, 50.0)));
  CHECK_FALSE(box.covers(at(2.1, 0.0, 0.0)));
  CHECK(box.covers(at(2.1, 0.0, 0.0), 0.2));
}

TEST_CASE("What stands on one day only has changed", "[changes]") {
  const std::vector<StandingObject> earlier = {parked(0), parked(10), parked(20)};
  const std::vector<StandingObject> later = {parked(0.001), parked(10, 18), parked(30)};
  const std::vector<TrueChange> changes = true_changes(earlier, later);
  REQUIRE(changes.size() == 4);
  CHECK(changes[0].change == ChangeKind::kGone);
  CHECK(changes[0].box.centre.x() == 10.0);
  CHECK(changes[0].is_replaced);
  CHECK(changes[1].box.centre.x() == 20.0);
  CHECK_FALSE(changes[1].is_replaced);
  CHECK(changes[2].change == ChangeKind::kAppeared);
  CHECK(changes[2].label == 18);
  CHECK(changes[2].is_replaced);
  CHECK(changes[3].box.centre.x() == 30.0);
  CHECK(true_changes(earlier, earlier).empty());
}

TEST_CASE("A change is found once, of its own kind and at its place", "[changes]") {
  const auto truth = observable(true_changes(std::vector{parked(0), parked(20)}, {}));
  const auto gone = [](double x, double y = 0.0) {
    return FoundChange{ChangeKind::kGone, car_at(x, y)};
  };
  CHECK(score({gone(0), gone(20)}, truth).recall() == 1.0);
  CHECK(score({gone(0), gone(20)}, truth).precision() == 1.0);
  CHECK(score({gone(1), gone(20)}, truth).recall() == 1.0);

  const ChangeScore twice = score({gone(0.5), gone(0)}, truth);
  CHECK(twice.found == std::vector{FoundClass::kPart, FoundClass::kRight});
  CHECK(twice.missed == std::vector<std::size_t>{1});

  const ChangeScore elsewhere = score({gone(0, 5.0)}, truth);
  CHECK(elsewhere.found == std::vector{FoundClass::kWrong});
  CHECK(elsewhere.precision() == 0.0);
  CHECK(elsewhere.recall() == 0.0);

  CHECK(score({{ChangeKind::kAppeared, car_at(0)}}, truth).recall() == 0.0);
  CHECK(score({{ChangeKind::kMoved, car_at(0)}}, truth).recall() == 0.5);
}

TEST_CASE("A part of what changed is no find of it, and not wrong", "[changes]") {
  const auto truth = observable(true_changes(std::vector{parked(0)}, {}));
  const FoundChange bonnet{ChangeKind::kGone, {{1.8, 0.0, 0.5}, 0.0, {0.8, 1.6, 0.8}}};
  const ChangeScore only_a_part = score({bonnet}, truth);
  CHECK(only_a_part.found == std::vector{FoundClass::kPart});
  CHECK(only_a_part.precision() == 1.0);
  CHECK(only_a_part.recall() == 0.0);
}

TEST_CASE("What stood during one visit, and what was replaced, is neither right nor wrong",
          "[changes]") {
  const std::vector<FoundChange> found = {{ChangeKind::kGone, car_at(0)},
                                          {ChangeKind::kGone, car_at(50)}};
  const auto truth = observable(true_changes(std::vector{parked(0)}, std::vector{parked(0.5)}));
  const ChangeScore with_person = score(found, truth, {false, true});
  CHECK(with_person.found == std::vector{FoundClass::kReplaced, FoundClass::kStood});
  CHECK(with_person.changed == 0);
  CHECK(std::isnan(with_person.recall()));
  CHECK(with_person.precision() == 1.0);
  CHECK(score(found, truth, {false, false}).precision() == 0.5);
}

TEST_CASE("Recall is about vehicles that both visits could see", "[changes]") {
  std::vector<TrueChange> truth =
      true_changes(std::vector{parked(0), parked(20), parked(40, 99), parked(60, 18)}, {});
  truth[0].is_observable = truth[2].is_observable = truth[3].is_observable = true;
  const ChangeScore none = score({}, truth);
  CHECK(none.changed == 2);
  CHECK(none.missed == std::vector<std::size_t>{0, 3});
  CHECK(std::isnan(none.precision()));
  // What was found of the others is right all the same.
  CHECK(score({{ChangeKind::kGone, car_at(20)}}, truth).count(FoundClass::kRight) == 1);
}
