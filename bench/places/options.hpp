// Command line of bench_places.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/places/pair_row.hpp"

namespace unimapper::bench {

enum class BaselineRows { kNone, kSame, kAll };

struct PlacesOptions {
  std::vector<std::filesystem::path> scenes;
  std::string title;
  std::vector<std::string> sensors = {"os2-128",       "os1-64",       "hdl-64e",   "vlp-16",
                                      "livox-mid-360", "aeva-aeries2", "livox-avia"};
  std::vector<std::string> routes = {"B", "C"};
  std::filesystem::path config;
  std::filesystem::path variants;
  std::filesystem::path out;
  BaselineRows baseline = BaselineRows::kAll;
  bool same_only = false;
  bool ablations_only = false;
  std::vector<std::filesystem::path> distractors;
  RowConfig row;
};

/// Reads the command line. False if there is nothing to do; `exit_code` says what to leave with.
[[nodiscard]] bool parse_options(int argc, char** argv, PlacesOptions& options, int& exit_code);

}  // namespace unimapper::bench
