// Median and quantiles against sorted values.
#include "src/core/quantile.hpp"

#include "tests/test.hpp"

using namespace unimapper;

namespace {

double median_of(std::vector<double> values) { return median(std::span(values)); }
int quantile_of(std::vector<int> values, double share) {
  return quantile(std::span(values), share);
}

}  // namespace

TEST_CASE("the median is the middle value, of an even number the larger of two") {
  CHECK(median_of({7.0}) == 7.0);
  CHECK(median_of({3.0, 1.0, 2.0}) == 2.0);
  CHECK(median_of({4.0, 1.0, 3.0, 2.0}) == 3.0);
}

TEST_CASE("a quantile is the smallest value that the share does not exceed") {
  std::vector<int> hundred;
  for (int i = 100; i > 0; --i) hundred.push_back(i);
  CHECK(quantile_of(hundred, 0.0) == 1);
  CHECK(quantile_of(hundred, 0.01) == 1);
  CHECK(quantile_of(hundred, 0.011) == 2);
  CHECK(quantile_of(hundred, 0.5) == 50);
  CHECK(quantile_of(hundred, 0.99) == 99);
  CHECK(quantile_of(hundred, 1.0) == 100);
  CHECK(quantile_of({5, 4, 3, 2, 1}, 0.99) == 5);
  CHECK(quantile_of({2, 1}, 0.5) == 1);
}
