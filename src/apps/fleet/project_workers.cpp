#include "src/apps/fleet/project_workers.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

#include "ports/linux/boot_id.hpp"
#include "src/apps/fleet/keyframe_files.hpp"
#include "src/apps/fleet/worker.hpp"
#include "src/apps/say.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::apps {
namespace {

/// Names a store in all its merges; no other machine, and no other store of this one, has it.
std::string project_token(const std::filesystem::path& store) {
  struct stat folder {};
  std::array<char, 256> host{};
  if (stat(store.c_str(), &folder) != 0 || gethostname(host.data(), host.size() - 1) != 0) {
    throw std::system_error(errno, std::generic_category(), store.string());
  }
  const std::string name = host.data() + std::filesystem::canonical(store).string();
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(name.data()), name.size());
  return fmt::format("{:08x}-{}-{}", wire::crc32(bytes), folder.st_dev, folder.st_ino);
}

LoopWorkersOptions options_of_merge() {
  LoopWorkersOptions options;
  for (std::string* random : {&options.merge, &options.salt}) {
    const BootId number = linux_port::random_boot();
    *random = fmt::format("{:016x}{:016x}", number.high, number.low);
  }
  return options;
}

}  // namespace

ProjectWorkers::ProjectWorkers(const nats_port::Server& server, const std::filesystem::path& store,
                               const merge::MergeConfig& config)
    : config_(config),
      reader_(store),
      board_(open_board(server, {worker_version(), project_token(store)})),
      workers_(*board_, options_of_merge(),
               [](const std::string& text) { say("warning: " + text); }) {}

std::vector<merge::LoopConstraint> ProjectWorkers::verify(
    const KeyframeRows& rows, std::span<const merge::LoopQuestion> questions,
    const merge::CorrectionLimit& limit, const merge::VerifyHere& verify_here) {
  return workers_.verify(
      rows.sessions(), config_, [&](KeyframeId k) { return publish(rows, k); }, questions, limit,
      verify_here);
}

const std::string& ProjectWorkers::publish(const KeyframeRows& rows, KeyframeId k) {
  const auto [entry, is_new] = published_.try_emplace(k);
  if (!is_new && !entry->second.empty()) return entry->second;
  const store::KeyframeRow row = rows.row(k);
  const std::vector<std::uint8_t> bytes = reader_.bytes(row.session, row.sequence);
  const std::string name = keyframe_name(rows.sessions()[k.session].info.id, row.sequence, bytes);
  board_->put_keyframe(name, bytes);
  entry->second = name;
  return entry->second;
}

}  // namespace unimapper::apps
