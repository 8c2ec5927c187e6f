// Tests of the calibration of loop scores.
#include "src/place/loop_confidence.hpp"

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::place;

TEST_CASE("a better score is worth more, from never to always, and its worth gives the score") {
  CHECK(probability_of(0.0F) == 0.0F);
  CHECK(probability_of(1.0F) == 1.0F);
  CHECK(score_of(0.97F) == Approx(0.5F).margin(1e-6));
  float last = -1.0F;
  for (int i = 0; i <= 1000; ++i) {
    const float score = static_cast<float>(i) / 1000.0F;
    const float probability = probability_of(score);
    CHECK(probability > last);
    CHECK(probability <= 1.0F);
    CHECK(score_of(probability) == Approx(score).margin(1e-4));
    last = probability;
  }
}
