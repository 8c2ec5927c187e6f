#include "ports/keys/key_files.hpp"

#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>

#include "ports/keys/library.hpp"
#include "ports/keys/private_file.hpp"
#include "unimapper/wire/messages.hpp"

namespace unimapper::keys {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kRobotTitle = "unimapper-robot-key 1";
constexpr std::string_view kBaseTitle = "unimapper-base-key 1";

std::string hexadecimal(std::span<const std::uint8_t> bytes) {
  std::string text(2 * bytes.size() + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), bytes.data(), bytes.size());
  text.pop_back();
  return text;
}

/// Reads the lines of a key file in order; the first that is not as expected spoils the rest.
class Lines {
 public:
  Lines(const fs::path& file, std::string_view title) : file_(file), text_(read_private(file)) {
    rest_ = text_;
    const std::string_view line = next();
    if (line != title)
      fail("is no such key file: its first line is not \"" + std::string(title) + "\"");
  }
  ~Lines() { sodium_memzero(text_.data(), text_.size()); }
  Lines(const Lines&) = delete;
  Lines& operator=(const Lines&) = delete;

  /// The value of the line that starts with this word.
  std::string_view value(std::string_view word) {
    const std::string_view line = next();
    if (!line.starts_with(word) || line.size() <= word.size() || line[word.size()] != ' ') {
      fail("the line \"" + std::string(word) + "\" is missing");
    }
    return line.substr(word.size() + 1);
  }
  std::string name() {
    const std::string_view text = value("name");
    if (!wire::is_session_name(text)) fail("its name cannot name a robot");
    return std::string(text);
  }
  std::uint32_t number(std::string_view word) {
    const std::string_view text = value(word);
    std::uint32_t number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || end != text.data() + text.size()) {
      fail("the line \"" + std::string(word) + "\" holds no number");
    }
    return number;
  }
  void bytes(std::string_view word, std::span<std::uint8_t> out) {
    const std::string_view text = value(word);
    std::size_t written = 0;
    const char* end = nullptr;
    const bool ok = sodium_hex2bin(out.data(), out.size(), text.data(), text.size(), nullptr,
                                   &written, &end) == 0;
    if (!ok || written != out.size() || end != text.data() + text.size()) {
      fail("the line \"" + std::string(word) + "\" does not hold " + std::to_string(out.size()) +
           " bytes");
    }
  }
  void end() {
    if (!rest_.empty()) fail("lines are left over");
  }

 private:
  std::string_view next() {
    const std::size_t end = rest_.find('\n');
    if (end == std::string_view::npos) fail("ends too early");
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return line;
  }
  [[noreturn]] void fail(const std::string& reason) const {
    throw KeyError(file_.string() + ": " + reason);
  }

  const fs::path& file_;
  std::string text_;
  std::string_view rest_;
};

std::string text_of(const BaseKey& key) {
  return std::string(kBaseTitle) + "\nname " + key.name + "\nrobot " + std::to_string(key.robot) +
         "\nrevoked " + (key.revoked ? "1" : "0") + "\nlink " + hexadecimal(key.link.bytes()) +
         "\nverifying " + hexadecimal(key.verifying) + "\n";
}

BaseKey read_base_key(const fs::path& file) {
  Lines lines(file, kBaseTitle);
  BaseKey key;
  key.name = lines.name();
  key.robot = lines.number("robot");
  key.revoked = lines.number("revoked") != 0;
  lines.bytes("link", {key.link.data(), LinkSecret::size()});
  lines.bytes("verifying", key.verifying);
  lines.end();
  if (file.stem() != key.name) throw KeyError(file.string() + ": holds the key of " + key.name);
  return key;
}

fs::path file_of(const fs::path& folder, const std::string& name) {
  return folder / (name + kKeyFileEnding);
}

}  // namespace

void write_robot_key(const fs::path& file, const RobotKey& key) {
  require_library();
  std::string text = std::string(kRobotTitle) + "\nname " + key.name + "\nrobot " +
                     std::to_string(key.robot) + "\nlink " + hexadecimal(key.link.bytes()) +
                     "\nseed " + hexadecimal(key.seed.bytes()) + "\n";
  write_private(file, text, Existing::kRefuse);
  sodium_memzero(text.data(), text.size());
}

RobotKey read_robot_key(const fs::path& file) {
  require_library();
  Lines lines(file, kRobotTitle);
  RobotKey key;
  key.name = lines.name();
  key.robot = lines.number("robot");
  lines.bytes("link", {key.link.data(), LinkSecret::size()});
  lines.bytes("seed", {key.seed.data(), SigningSeed::size()});
  lines.end();
  return key;
}

void add_base_key(const fs::path& folder, const BaseKey& key) {
  require_library();
  make_private_folder(folder);
  for (const BaseKey& other : read_base_keys(folder)) {
    if (other.name == key.name) {
      throw KeyError(folder.string() + ": has a key of " + key.name + " already" +
                     (other.revoked ? ", revoked; choose another name" : ""));
    }
    if (other.robot == key.robot) {
      throw KeyError(folder.string() + ": the robot's number is that of " + other.name);
    }
  }
  write_private(file_of(folder, key.name), text_of(key), Existing::kRefuse);
}

std::vector<BaseKey> read_base_keys(const fs::path& folder) {
  require_library();
  check_private_folder(folder);
  std::vector<BaseKey> keys;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == kKeyFileEnding) keys.push_back(read_base_key(entry.path()));
  }
  std::sort(keys.begin(), keys.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  for (std::size_t i = 0; i < keys.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (keys[i].robot != keys[j].robot) continue;
      throw KeyError(folder.string() + ": " + keys[j].name + " and " + keys[i].name +
                     " have one robot number");
    }
  }
  return keys;
}

void revoke_base_key(const fs::path& folder, const std::string& name) {
  for (BaseKey& key : read_base_keys(folder)) {
    if (key.name != name) continue;
    if (key.revoked)
      throw KeyError(folder.string() + ": the key of " + name + " is revoked already");
    key.revoked = true;
    write_private(file_of(folder, name), text_of(key), Existing::kReplace);
    return;
  }
  throw KeyError(folder.string() + ": has no key of " + name);
}

}  // namespace unimapper::keys
