// Tests of torn, damaged and foreign segments.
#include "ports/spool/spool.hpp"
#include "tests/ports/spool/keyframes.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::spool;
using namespace unimapper::spool::spool_test;

namespace {

constexpr std::size_t kBytes = 60;
constexpr std::uint32_t kKeyframes = 4;
constexpr auto kHeadBytes = static_cast<std::size_t>(kSegmentHeadBytes);

/// With one bit of byte `at` changed.
std::string with_flipped(std::string bytes, std::size_t at) {
  bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ (1U << (at % 8)));
  return bytes;
}

/// A segment with a few small keyframes, as a string.
struct OneSegment {
  TemporaryDirectory folder;
  std::filesystem::path file;
  std::string content;

  OneSegment() {
    {
      Spool spool(folder / "spool");
      add(spool, kMonday, 0, kKeyframes, kBytes);
    }
    file = segments_of(folder / "spool").at(0);
    content = content_of(file);
  }
  [[nodiscard]] std::size_t record_bytes() const {
    return (content.size() - kHeadBytes) / kKeyframes;
  }
  /// Keyframes that are read back as they were written; anything else fails the test.
  std::vector<bool> survivors() {
    Spool spool(folder / "spool");
    std::vector<bool> equal;
    for (std::uint32_t i = 0; i < kKeyframes; ++i) {
      const bool found = spool.read(kMonday.id, i).has_value();
      equal.push_back(has_equal(spool, kMonday, i, kBytes));
      CHECK(equal.back() == found);
    }
    return equal;
  }
};

}  // namespace

TEST_CASE("a tail torn at any byte costs that record alone; a new segment follows it") {
  OneSegment segment;
  const std::size_t record = segment.record_bytes();
  REQUIRE(kHeadBytes + record * kKeyframes == segment.content.size());
  for (std::size_t cut = record; cut > 0; --cut) {
    CAPTURE(cut);
    write_content(segment.file, segment.content.substr(0, segment.content.size() - cut));
    CHECK(segment.survivors() == std::vector<bool>{true, true, true, false});
  }
  {
    Spool spool(segment.folder / "spool");
    add(spool, kMonday, 3, 4, kBytes);
  }
  CHECK(segments_of(segment.folder / "spool").size() == 2);
  CHECK(segment.survivors() == std::vector<bool>{true, true, true, true});
}

TEST_CASE("a flipped bit costs one record at most, and is counted") {
  OneSegment segment;
  const std::size_t record = segment.record_bytes();
  for (std::size_t i = kHeadBytes; i < segment.content.size(); i += 5) {
    CAPTURE(i);
    write_content(segment.file, with_flipped(segment.content, i));
    std::vector<bool> expected(kKeyframes, true);
    expected[(i - kHeadBytes) / record] = false;
    CHECK(segment.survivors() == expected);
  }
}

TEST_CASE("damage is told apart: heads when the spool opens, data when they are read") {
  OneSegment segment;
  write_content(segment.file, with_flipped(with_flipped(segment.content, kHeadBytes),
                                           segment.content.size() - 1));
  Spool spool(segment.folder / "spool");
  CHECK(spool.counters().faults == 1);
  CHECK(spool.counters().keyframes_on_disk == kKeyframes - 1);
  CHECK(spool.holds(kMonday.id, kKeyframes - 1));
  CHECK_FALSE(spool.read(kMonday.id, kKeyframes - 1));
  CHECK_FALSE(spool.holds(kMonday.id, kKeyframes - 1));
  CHECK(spool.counters().keyframes_damaged == 1);
}

TEST_CASE("segments of other versions and other files are counted and left alone") {
  OneSegment segment;
  const auto folder = segment.folder / "spool";
  std::string newer = segment.content;
  newer[11] = 2;  // the version
  write_content(folder / segment_name(2), newer);
  write_content(folder / segment_name(4), "no segment at all, whatever it is");
  std::filesystem::create_directory(folder / segment_name(5));
  write_content(folder / "notes.txt", "mine");
  {
    std::string said;
    SpoolOptions options;
    options.report = [&](const std::string& text) { said += text; };
    Spool spool(folder, options);
    CHECK(spool.counters().segments_skipped == 3);
    CHECK(said.find("3 files are no segments") != std::string::npos);
    CHECK(spool.counters().keyframes_on_disk == kKeyframes);
    add(spool, kTuesday, 0, 1);
  }
  CHECK(content_of(folder / segment_name(2)) == newer);
  CHECK(content_of(folder / "notes.txt") == "mine");
  CHECK(std::filesystem::exists(folder / segment_name(6)));
}

TEST_CASE("a segment torn within its head is empty, and neither counted nor in the way") {
  OneSegment segment;
  const auto torn = segment.folder / "spool" / segment_name(2);
  for (std::size_t bytes = 0; bytes <= kHeadBytes; ++bytes) {
    CAPTURE(bytes);
    write_content(torn, segment.content.substr(0, bytes));
    CHECK(segment.survivors() == std::vector<bool>(kKeyframes, true));
    const Spool spool(segment.folder / "spool");
    CHECK(spool.counters().segments_skipped == 0);
    CHECK(spool.counters().faults == 0);
  }
}

TEST_CASE("names of segments are those that the spool gives") {
  CHECK(segment_name(0x1a) == "000000000000001a.spool");
  CHECK(segment_number("000000000000001a.spool") == 0x1aU);
  for (const char* name : {"000000000000001A.spool", "1a.spool", "00000000000001a.spool",
                           "000000000000001a.spool2", "+00000000000001a.spool", "lock"}) {
    CHECK_FALSE(segment_number(name));
  }
}
