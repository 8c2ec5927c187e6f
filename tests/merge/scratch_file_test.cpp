// Tests of the temporary file of a merge
#include "unimapper/merge/scratch_file.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>
#include <memory>
#include <numeric>
#include <vector>

#include "tests/temporary_directory.hpp"
#include "unimapper/merge/external_vector.hpp"

using namespace unimapper;
using namespace unimapper::merge;
using Catch::Matchers::Contains;

namespace {

/// Files of this process cannot grow beyond a size: as if the disk were full.
class LargestFile {
 public:
  explicit LargestFile(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~LargestFile() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  LargestFile(const LargestFile&) = delete;
  LargestFile& operator=(const LargestFile&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

}  // namespace

TEST_CASE("A scratch file gives back what was appended, and has no name", "[scratch]") {
  const TemporaryDirectory folder;
  ScratchFile file(folder.path());
  std::vector<std::uint32_t> numbers(1000);
  std::iota(numbers.begin(), numbers.end(), 7U);
  CHECK(file.append(numbers.data(), 4 * numbers.size()) == 0);
  CHECK(file.append(numbers.data(), 40) == 4 * numbers.size());
  std::array<std::uint32_t, 3> read{};
  file.read(4 * 998, read.data(), sizeof read);
  CHECK((read == std::array<std::uint32_t, 3>{1005, 1006, 7}));
  CHECK(std::filesystem::is_empty(folder.path()));
  CHECK_THROWS_WITH(file.read(4 * 1009, read.data(), sizeof read), Contains("cannot be read"));
}

TEST_CASE("A scratch file that cannot be made or written is an error", "[scratch]") {
  const TemporaryDirectory folder;
  CHECK_THROWS_WITH(ScratchFile(folder.path() / "nowhere"), Contains("cannot be made"));
  ScratchFile file(folder.path());
  const std::vector<char> bytes(10'000);
  const LargestFile full(5'000);
  CHECK_THROWS_WITH(file.append(bytes.data(), bytes.size()), Contains("cannot be written"));
}

TEST_CASE("A vector in a file is read as it is in memory, from any place and by its copies",
          "[scratch]") {
  const TemporaryDirectory folder;
  const auto file = std::make_shared<ScratchFile>(folder.path());
  for (const std::uint64_t count : {0ULL, 1ULL, 8191ULL, 8192ULL, 8193ULL, 50'000ULL}) {
    INFO(count);
    ExternalVector<std::uint64_t> there(file);
    ExternalVector<std::uint64_t> here;
    for (std::uint64_t i = 0; i < count; ++i) {
      there.push_back(7 * i);
      here.push_back(7 * i);
    }
    CHECK(there.size() == count);
    CHECK(there.empty() == (count == 0));
    CHECK(std::equal(there.begin(), there.end(), here.begin(), here.end()));
    // A copy has what was there, and what comes later is its own.
    ExternalVector<std::uint64_t> copy = there;
    for (std::uint64_t i = 0; i < 9'000; ++i) copy.push_back(i);
    there.push_back(1);
    CHECK(copy.size() == count + 9'000);
    CHECK(std::equal(here.begin(), here.end(), copy.begin()));
    // An iterator that stays behind reads on where it was.
    auto behind = there.begin();
    std::uint64_t sum = 0;
    for (const std::uint64_t value : there) sum += value;
    CHECK(sum == 7 * count * (count > 0 ? count - 1 : 0) / 2 + 1);
    if (count > 0) CHECK(*behind == 0);
  }
}
