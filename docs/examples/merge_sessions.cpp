// Merging from a program: files of keyframes in, one map out, without the tool.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>
#include <unimapper/merge/keyframe_level.hpp>
#include <unimapper/merge/merger.hpp>
#include <unimapper/wire/keyframe_codec.hpp>

using namespace unimapper;

SessionData read_session(const std::filesystem::path& folder) {
  SessionData session;
  using Folder = std::filesystem::directory_iterator;  // in no order: sorted by name
  for (const std::filesystem::path& path : std::set<std::filesystem::path>(Folder(folder), {})) {
    std::ifstream file(path, std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
    wire::DecodedKeyframe keyframe = wire::decode_keyframe(bytes);
    if (!keyframe.record) throw std::runtime_error(path.string() + ": " + keyframe.error);
    session.keyframes.push_back(std::move(*keyframe.record));
  }
  session.info = {session.keyframes.at(0).session, folder.filename().string(), "vlp-16"};
  session.complete = true;
  return session;
}

int main(int argc, char** argv) try {
  std::vector<SessionData> sessions;
  for (int i = 1; i < argc; ++i) sessions.push_back(read_session(argv[i]));
  for (SessionData& session : sessions) (void)merge::level_keyframes(session.keyframes);
  const merge::MergeResult result = merge::merge_sessions(sessions);
  for (std::size_t i = 0; i < sessions.size(); ++i)
    std::printf("%s: %s\n", sessions[i].info.name.c_str(),
                merge::status_name(result.sessions[i].status));
  std::printf("%zu points in the map\n", result.map.size());
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 2;
}
