// Small hand-made dataset files.
#pragma once

#include "ports/datasets/dataset.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

namespace unimapper::datasets {

/// Bytes from hexadecimal digits; blanks are for the reader.
inline std::string hex(std::string_view digits) {
  std::string bytes;
  int high = -1;
  for (const char c : digits) {
    if (c == ' ' || c == '\n') continue;
    const int value = c <= '9' ? c - '0' : c - 'a' + 10;
    if (high < 0) {
      high = value;
    } else {
      bytes += static_cast<char>(high * 16 + value);
      high = -1;
    }
  }
  return bytes;
}

inline std::string read_bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// The message of the DatasetError that `call` throws; fails the test if it throws none.
template <typename Call>
std::string error_of(const Call& call) {
  try {
    call();
  } catch (const DatasetError& error) {
    return error.what();
  }
  FAIL("no DatasetError was thrown");
  return {};
}

/// The message with which the recording at `path` is refused.
inline std::string open_error(const std::filesystem::path& path, const OpenOptions& options = {}) {
  return error_of([&] { (void)open_dataset(path, options); });
}

/// An input, and what the message that refuses it contains.
struct Refusal {
  std::string input;
  std::vector<std::string> message;
};

template <typename Parse>
void check_refusals(const std::vector<Refusal>& refusals, const Parse& parse) {
  for (const Refusal& refusal : refusals) {
    INFO(refusal.input);
    const std::string error = error_of([&] { parse(refusal.input); });
    for (const std::string& part : refusal.message)
      CHECK_THAT(error, Catch::Matchers::Contains(part));
  }
}

inline Scan scan_of(const Dataset& dataset, std::size_t i) {
  Scan scan;
  dataset.read_scan(i, scan);
  return scan;
}

/// All notes in one text; warnings begin with "!".
inline std::string notes_text(const Dataset& dataset) {
  std::string text;
  for (const Note& note : dataset.notes()) {
    text += (note.is_warning ? "! " : "- ") + note.text + "\n";
  }
  return text;
}

/// x = 1, y = -2, z = 0.5, intensity = 0.25 as they lie in a KITTI scan.
inline const std::string kPointBytes = hex("0000803f 000000c0 0000003f 0000803e");

/// The identity, and a pose one metre ahead, as KITTI writes poses.
inline const std::string kIdentityLine = "1 0 0 0 0 1 0 0 0 0 1 0\n";
inline const std::string kOneMetreAheadLine = "1 0 0 1 0 1 0 0 0 0 1 0\n";

}  // namespace unimapper::datasets
