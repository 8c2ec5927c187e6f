// Project in a store of its own, for tests of `unimapper map`.
#pragma once

#include <nlohmann/json.hpp>

#include "ports/store/store_reader.hpp"
#include "tests/apps/command.hpp"

namespace unimapper::apps {

inline nlohmann::json read_json(const std::filesystem::path& file) {
  return nlohmann::json::parse(read_text(file));
}

/// A new project; whatever it is asked, its store stays sound.
struct Project {
  TemporaryDirectory directory;
  std::string store = directory / "store";

  Project() { done({"create"}); }

  [[nodiscard]] Words words(const Words& arguments) const {
    Words all = {"map", arguments.front(), "--store", store};
    all.insert(all.end(), arguments.begin() + 1, arguments.end());
    return all;
  }
  CommandResult done(const Words& arguments) const {
    CommandResult result = run_well(words(arguments));
    CHECK(store::StoreReader(store).check().empty());
    return result;
  }
  void refused(const Words& arguments, const std::string& why, int exit_code = 1) const {
    check_fails(run_unimapper(words(arguments)), why, exit_code);
    CHECK(store::StoreReader(store).check().empty());
  }
  [[nodiscard]] std::string run(const std::string& name, std::size_t scans) const {
    return make_run(directory, name, scans);
  }
  [[nodiscard]] nlohmann::json show() const {
    return nlohmann::json::parse(done({"show", "--json"}).out);
  }
  [[nodiscard]] nlohmann::json statements() const { return show()["statements"]; }
  /// The folder of the map that is exported there.
  std::filesystem::path exported(const std::string& folder, const Words& more = {}) const {
    Words arguments = {"export", "--out", directory / folder};
    arguments.insert(arguments.end(), more.begin(), more.end());
    done(arguments);
    return directory / folder;
  }
};

}  // namespace unimapper::apps
