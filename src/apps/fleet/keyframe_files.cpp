#include "src/apps/fleet/keyframe_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "unimapper/wire/byte_io.hpp"

namespace unimapper::apps {

namespace fs = std::filesystem;

namespace {

std::string ending_of(std::span<const std::uint8_t> bytes) {
  return fmt::format("-{:08x}-{}", wire::crc32(bytes), bytes.size());
}

bool is_name(const std::string& name) {
  return !name.empty() && name.size() < 128 &&
         name.find_first_not_of("0123456789abcdef-") == std::string::npos;
}

std::vector<std::uint8_t> read_bytes(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

std::string keyframe_name(const SessionId& session, std::uint32_t sequence,
                          std::span<const std::uint8_t> bytes) {
  return fmt::format("{}-{:016x}{:016x}-{}", session.robot, session.boot.high, session.boot.low,
                     sequence) +
         ending_of(bytes);
}

bool has_name(const std::string& name, std::span<const std::uint8_t> bytes) {
  return name.ends_with(ending_of(bytes));
}

KeyframeFiles::KeyframeFiles(fs::path folder, std::uint64_t max_bytes)
    : folder_(std::move(folder)), max_bytes_(max_bytes) {
  if (folder_.empty()) return;
  lock_.emplace(folder_, "a worker");
  for (const auto& entry : fs::directory_iterator(folder_)) {
    if (is_name(entry.path().filename().string())) {
      bytes_ += entry.file_size();
    } else if (entry.path().extension() == ".part") {
      fs::remove(entry.path());
    }
  }
}

std::vector<std::uint8_t> KeyframeFiles::get(const std::string& name, const Fetch& fetch) {
  if (!is_name(name)) throw std::runtime_error("\"" + name + "\" names no keyframe");
  if (!folder_.empty()) {
    std::vector<std::uint8_t> bytes = read_bytes(folder_ / name);
    if (has_name(name, bytes)) {
      std::error_code ignored;
      fs::last_write_time(folder_ / name, fs::file_time_type::clock::now(), ignored);
      return bytes;
    }
  }
  std::vector<std::uint8_t> bytes = fetch(name);
  if (!has_name(name, bytes)) throw std::runtime_error("keyframe " + name + " is damaged");
  if (!folder_.empty()) keep(name, bytes);
  return bytes;
}

// A tenth more than is needed, so that the folder is not looked through for each keyframe.
void KeyframeFiles::remove_oldest(std::uint64_t wanted) {
  std::error_code error;
  std::vector<std::pair<fs::file_time_type, fs::path>> files;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    if (is_name(entry.path().filename().string())) {
      files.emplace_back(entry.last_write_time(error), entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  for (const auto& [time, file] : files) {
    if (bytes_ + wanted <= max_bytes_) break;
    const std::uint64_t size = fs::file_size(file, error);
    if (!error && fs::remove(file, error)) bytes_ -= std::min(bytes_, size);
  }
}

void KeyframeFiles::keep(const std::string& name, std::span<const std::uint8_t> bytes) {
  const std::lock_guard<std::mutex> lock(guard_);
  if (bytes_ + bytes.size() > max_bytes_) remove_oldest(bytes.size() + max_bytes_ / 10);
  if (bytes_ + bytes.size() > max_bytes_) return;
  std::error_code error;
  const fs::path part = folder_ / (name + ".part");
  {
    std::ofstream out(part, std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()),
              static_cast<std::streamsize>(bytes.size()));
    if (!out.flush()) error = std::make_error_code(std::errc::io_error);
  }
  if (!error) fs::rename(part, folder_ / name, error);
  if (error) {
    fs::remove(part, error);
  } else {
    bytes_ += bytes.size();
  }
}

}  // namespace unimapper::apps
