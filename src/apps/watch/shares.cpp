#include "src/apps/watch/shares.hpp"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "ports/shared_memory/contents.hpp"

namespace unimapper::apps {

std::vector<std::string> list_shares() {
  constexpr std::string_view kBegin = "unimapper.";
  const std::string end = std::string(".") + shared_memory::kKeyframeTopic;
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/shm", error)) {
    const std::string file = entry.path().filename().string();
    if (!file.starts_with(kBegin) || !file.ends_with(end)) continue;
    if (file.size() <= kBegin.size() + end.size()) continue;
    names.push_back(file.substr(kBegin.size(), file.size() - kBegin.size() - end.size()));
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace unimapper::apps
