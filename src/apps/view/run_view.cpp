// `unimapper view`: a map in a browser.
#include <filesystem>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "ports/store/store_reader.hpp"
#include "src/apps/say.hpp"
#include "src/apps/stop_signals.hpp"
#include "src/apps/view/map_files.hpp"
#include "src/apps/view/store_view.hpp"
#include "src/apps/view/view_options.hpp"
#include "src/apps/view/view_server.hpp"

namespace unimapper::apps {
namespace {

/// A store, or a place where a base can make one.
bool is_or_becomes_store(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  if (store::is_store(path)) return true;
  std::error_code error;
  if (fs::exists(path, error)) {
    // A base makes its lock first.
    return fs::is_directory(path, error) &&
           (fs::is_empty(path, error) || fs::exists(path / "lock", error));
  }
  const fs::path folder = path.has_filename() ? path : path.parent_path();
  return fs::is_directory(fs::absolute(folder).parent_path(), error);
}

std::unique_ptr<ViewSource> source_of(const ViewOptions& options) {
  const bool is_store = store::is_store(options.map);
  if (!is_store && options.epoch > 0) {
    throw std::runtime_error(options.map.string() + ": is no store, so it has no epochs");
  }
  if (!is_or_becomes_store(options.map)) {
    return std::make_unique<FolderView>(options.map / kViewFolder);
  }
  if (!is_store) {
    say("warning: " + options.map.string() +
        " holds no map and no store: the page shows what a base will store there");
  }
  StoreViewOptions shown;
  shown.store = options.map;
  shown.epoch = options.epoch;
  shown.may_change = !options.read_only;
  shown.report = &say;
  return std::make_unique<StoreView>(std::move(shown));
}

}  // namespace

void run_view(const ViewOptions& options) {
  StopSignals signals;
  const bool may_change = !options.read_only && is_or_becomes_store(options.map);
  const std::unique_ptr<ViewSource> source = source_of(options);
  ViewServerOptions serving;
  serving.address = options.http;
  serving.page = empty_page();
  if (may_change) serving.token = make_token();
  const ViewServer server(serving, *source);
  std::cout << "the map is at " << server.url() << std::endl;
  signals.wait();
}

}  // namespace unimapper::apps
