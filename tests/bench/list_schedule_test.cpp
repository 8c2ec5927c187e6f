// Tests of the model of workers in numbers: what they wait for, read and build.
#include "bench/fleet/list_schedule.hpp"

#include <limits>

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::bench;

namespace {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();
/// Seconds of a keyframe, a cloud and a loop.
constexpr Costs kCosts{1.0, 2.0, 4.0};

/// Of two loops, about keyframes `first` and the one after it; reads the one after these, too.
Job job_of(std::uint32_t lane, std::size_t first) {
  return {lane, {{0, first}, {0, first + 1}, {0, first + 2}}, {{0, first}, {0, first + 1}}, 2};
}

Schedule with(const std::vector<std::vector<Job>>& calls, std::size_t workers,
              double link_bytes_per_s = kNoLimit) {
  return scheduled(
      calls, [](KeyframeId) { return 10; }, workers, kCosts, link_bytes_per_s);
}

}  // namespace

TEST_CASE("a worker reads each keyframe and builds each cloud once", "[fleet]") {
  const Schedule once = with({{job_of(0, 0)}}, 1);
  CHECK(once.busy_s == Approx(3 * 1.0 + 2 * 2.0 + 2 * 4.0));
  CHECK(once.end_s == Approx(once.busy_s + kJobS));
  CHECK(once.clouds == 2);
  const Schedule twice = with({{job_of(0, 0), job_of(0, 0)}}, 1);
  CHECK(twice.busy_s == Approx(once.busy_s + 2 * 4.0));
  CHECK(twice.clouds == 2);
}

TEST_CASE("two workers halve the time of lanes that share nothing", "[fleet]") {
  const std::vector<Job> jobs{job_of(0, 0), job_of(9, 50), job_of(0, 0), job_of(9, 50)};
  const Schedule one = with({jobs}, 1);
  const Schedule two = with({jobs}, 2);
  CHECK(two.end_s == Approx(one.end_s / 2));
  CHECK(two.busy_s == Approx(one.busy_s));
  CHECK(two.clouds == one.clouds);
}

TEST_CASE("two workers of one lane build its clouds twice", "[fleet]") {
  const std::vector<Job> jobs{job_of(0, 0), job_of(0, 0)};
  CHECK(with({jobs}, 1).clouds == 2);
  CHECK(with({jobs}, 2).clouds == 4);
}

TEST_CASE("a call waits for all jobs of the one before", "[fleet]") {
  const double job_s = with({{job_of(0, 0)}}, 1).end_s;
  CHECK(with({{job_of(0, 0), job_of(9, 50)}, {job_of(20, 70)}}, 2).end_s == Approx(2 * job_s));
}

TEST_CASE("workers wait for each other where they share a slow link", "[fleet]") {
  const std::vector<Job> jobs{job_of(0, 0), job_of(9, 50)};
  const double job_s = with({{job_of(0, 0)}}, 1).end_s;
  // 30 bytes a job, at one a second.
  CHECK(with({jobs}, 2, 1.0).end_s == Approx(2 * 30.0 + job_s));
}
