#include "ports/datasets/files.hpp"

#include <stdlib.h>  // NOLINT: mkdtemp is POSIX

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <system_error>

namespace unimapper::datasets {

namespace fs = std::filesystem;

void fail(const fs::path& file, const std::string& reason) {
  throw DatasetError(file.string() + ": " + reason);
}

void fail_at_offset(const fs::path& file, std::uint64_t offset, const std::string& reason) {
  throw DatasetError(file.string() + ": offset " + std::to_string(offset) + ": " + reason);
}

void fail_at_line(const fs::path& file, std::size_t line, const std::string& reason) {
  throw DatasetError(file.string() + ":" + std::to_string(line) + ": " + reason);
}

std::uint64_t file_bytes(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) fail(file, "no such file");
  if (!fs::is_regular_file(status)) fail(file, "is not a regular file");
  const std::uintmax_t bytes = fs::file_size(file, error);
  if (error) fail(file, error.message());
  return bytes;
}

std::size_t read_file(const fs::path& file, std::span<char> content) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(file.c_str(), "rb"),
                                                               &std::fclose);
  if (!stream) fail(file, std::string("cannot open: ") + std::strerror(errno));
  const std::size_t got = std::fread(content.data(), 1, content.size(), stream.get());
  if (std::ferror(stream.get()) != 0) {
    fail_at_offset(file, got, std::string("cannot read: ") + std::strerror(errno));
  }
  return got;
}

std::string read_file(const fs::path& file, std::size_t limit) {
  std::string content(static_cast<std::size_t>(std::min<std::uint64_t>(file_bytes(file), limit)),
                      '\0');
  content.resize(read_file(file, std::span(content)));
  return content;
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Takes the run of digits at the beginning of `text`, without leading zeros.
std::string_view take_number(std::string_view& text) {
  std::size_t end = 0;
  while (end < text.size() && is_digit(text[end])) ++end;
  std::string_view number = text.substr(0, end);
  text.remove_prefix(end);
  while (number.size() > 1 && number.front() == '0') number.remove_prefix(1);
  return number;
}

}  // namespace

bool natural_less(std::string_view a, std::string_view b) {
  std::string_view rest_a = a;
  std::string_view rest_b = b;
  while (!rest_a.empty() && !rest_b.empty()) {
    if (is_digit(rest_a.front()) && is_digit(rest_b.front())) {
      const std::string_view number_a = take_number(rest_a);
      const std::string_view number_b = take_number(rest_b);
      if (number_a.size() != number_b.size()) return number_a.size() < number_b.size();
      if (number_a != number_b) return number_a < number_b;
      continue;
    }
    if (rest_a.front() != rest_b.front()) return rest_a.front() < rest_b.front();
    rest_a.remove_prefix(1);
    rest_b.remove_prefix(1);
  }
  if (rest_a.empty() != rest_b.empty()) return rest_a.empty();
  return a < b;  // 1 and 01: any order, but always the same
}

namespace {

std::vector<fs::path> sorted_children(const fs::path& directory) {
  std::error_code error;
  fs::directory_iterator iterator(directory, error);
  if (error) fail(directory, "cannot list the directory: " + error.message());
  std::vector<fs::path> children;
  for (; iterator != fs::directory_iterator(); iterator.increment(error)) {
    children.push_back(iterator->path());
    if (error) break;
  }
  if (error) fail(directory, "cannot list the directory: " + error.message());
  std::sort(children.begin(), children.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return children;
}

}  // namespace

std::vector<fs::path> list_files(const fs::path& directory, std::string_view extension) {
  std::vector<fs::path> files;
  for (const fs::path& child : sorted_children(directory)) {
    const std::string name = child.filename().string();
    std::error_code error;
    if (name.starts_with('.') || lower_case(child.extension().string()) != extension) continue;
    if (fs::is_regular_file(child, error)) files.push_back(child);
  }
  return files;
}

std::vector<fs::path> list_directories(const fs::path& directory) {
  std::vector<fs::path> directories;
  for (const fs::path& child : sorted_children(directory)) {
    std::error_code error;
    if (fs::is_directory(child, error)) directories.push_back(child);
  }
  return directories;
}

bool holds(const fs::path& directory, std::string_view extension) {
  std::error_code error;
  return fs::is_directory(directory, error) && !list_files(directory, extension).empty();
}

fs::path find_child(const fs::path& directory, std::initializer_list<std::string_view> names) {
  std::error_code error;
  if (!fs::is_directory(directory, error)) return {};
  const std::vector<fs::path> children = sorted_children(directory);
  for (const std::string_view name : names) {
    for (const fs::path& child : children) {
      if (lower_case(child.filename().string()) == lower_case(name)) return child;
    }
  }
  return {};
}

TemporaryFolder::TemporaryFolder(const fs::path& parent) {
  std::string name = (parent / ".unimapper-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw DatasetError(name + ": cannot be made");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace unimapper::datasets
