// A base station of one's own: files of keyframes in, one map out, without the tool.
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>
#include <vector>

#include "street.h"
#include "unimapper/merge/merger.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

using namespace unimapper;

namespace {

SessionData read_session(const std::filesystem::path& directory) {
  std::set<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) {
    files.insert(entry.path());
  }
  SessionData session;
  session.complete = true;
  for (const std::filesystem::path& path : files) {
    std::ifstream file(path, std::ios::binary);
    const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file),
                                          std::istreambuf_iterator<char>()};
    wire::DecodedKeyframe decoded = wire::decode_keyframe(bytes);
    if (!decoded.record) throw std::runtime_error(path.string() + ": " + decoded.error);
    session.keyframes.push_back(std::move(*decoded.record));
  }
  session.info.id = session.keyframes.at(0).session;
  session.info.name = directory.filename().string();
  session.info.sensor = "vlp-16";
  return session;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc != 3) return std::puts("usage: merge_sessions FIRST SECOND"), 2;
    const std::vector<SessionData> sessions{read_session(argv[1]), read_session(argv[2])};
    const merge::MergeResult result = merge::merge_sessions(sessions, {});
    for (std::size_t i = 0; i < sessions.size(); ++i) {
      std::printf("%s: %zu keyframes, %s\n", sessions[i].info.name.c_str(),
                  sessions[i].keyframes.size(), merge::status_name(result.sessions[i].status));
    }
    // What the merger must find: how the second robot's odometry lies in the first one's.
    const Pose T_second_first(
        Eigen::Quaterniond(Eigen::AngleAxisd(kSecondYaw, Eigen::Vector3d::UnitZ())),
        Eigen::Vector3d(kSecondTranslation));
    const Pose T_first_second =
        result.sessions[0].T_map_session.inverse() * result.sessions[1].T_map_session;
    const Pose error = T_first_second * T_second_first;
    std::printf("%zu map points, error %.2f m\n", result.map.size(), error.translation.norm());
    return error.translation.norm() < 0.5 && !result.map.empty() ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
