// Files of a bag: recognition by first bytes, recordings in several files.
#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

#include "ports/datasets/bag/byte_file.hpp"
#include "ports/datasets/bag/decompress.hpp"
#include "ports/datasets/bag/mcap_records.hpp"
#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/files.hpp"

namespace unimapper::datasets::bag {

namespace fs = std::filesystem;

namespace {

/// The form of a bag's file: its first bytes, and the ending of its name.
struct BagForm {
  std::string_view magic;
  std::string_view extension;
  std::unique_ptr<MessageSource> (*open)(const fs::path& file);
};

constexpr std::array<BagForm, 3> kForms = {{
    {kMcapMagic, ".mcap", &open_mcap},
    {{"SQLite format 3\0", 16}, ".db3", &open_sqlite_bag},
    // Older versions begin with "#ROSRECORD" and "#ROSLOG": their reader says what to do.
    {"#ROS", ".bag", &open_ros1_bag},
}};

/// rosbag2 may compress whole files: "drive_0.db3.zstd".
constexpr std::string_view kZstdFileMagic = "\x28\xB5\x2F\xFD";
constexpr std::string_view kZstdFileExtension = ".zstd";

bool begins_with(const ByteFile& file, std::string_view magic) {
  std::string buffer;
  return file.size() >= magic.size() && file.read(0, magic.size(), buffer) == magic;
}

const BagForm* form_of(const fs::path& file) {
  const ByteFile bytes(file);
  const auto form = std::find_if(kForms.begin(), kForms.end(), [&](const BagForm& known) {
    return begins_with(bytes, known.magic);
  });
  return form == kForms.end() ? nullptr : &*form;
}

bool has_bag_extension(const fs::path& file) {
  const std::string extension = lower_case(file.extension().string());
  return std::any_of(kForms.begin(), kForms.end(),
                     [&](const BagForm& form) { return form.extension == extension; });
}

std::vector<fs::path> bag_files(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const BagForm& form : kForms) {
    const auto more = list_files(folder, form.extension);
    files.insert(files.end(), more.begin(), more.end());
  }
  for (const fs::path& file : list_files(folder, kZstdFileExtension)) {
    if (has_bag_extension(file.stem())) files.push_back(file);
  }
  return files;
}

/// The number that recorders end the names of a recording's files with: "drive_0".
std::optional<std::uint32_t> split_number(const fs::path& file) {
  const bool is_packed = file.extension() == kZstdFileExtension;
  const std::string stem = (is_packed ? file.stem() : file).stem().string();
  const std::size_t begin = stem.find_last_not_of("0123456789") + 1;
  if (begin == 0 || begin == stem.size() || stem[begin - 1] != '_') return std::nullopt;
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(stem.data() + begin, stem.data() + stem.size(), number);
  return error == std::errc() ? std::optional(number) : std::nullopt;
}

/// True if the files are numbered from 0 on, as recorders number those of one recording.
bool are_splits(const std::vector<fs::path>& files) {
  std::vector<std::uint32_t> numbers;
  for (const fs::path& file : files) {
    const auto number = split_number(file);
    if (!number) return false;
    numbers.push_back(*number);
  }
  std::sort(numbers.begin(), numbers.end());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] != i) return false;
  }
  return true;
}

/// Several files of one recording.
class SplitSource final : public MessageSource {
 public:
  explicit SplitSource(std::vector<std::unique_ptr<MessageSource>> files)
      : files_(std::move(files)) {
    for (std::size_t i = 0; i < files_.size(); ++i) take(*files_[i], static_cast<std::uint32_t>(i));
    finish();
  }

  std::string_view read(const MessagePlace& place, std::size_t limit) override {
    return files_.at(place.file)->read(place, limit);
  }

 private:
  void take(const MessageSource& source, std::uint32_t file) {
    for (const std::string& warning : source.warnings()) warn(warning);
    for (std::size_t i = 0; i < source.topics().size(); ++i) {
      const Topic& topic = source.topics()[i];
      const std::size_t number = add_topic(topic.name, topic.type, topic.serialization);
      const auto& places = source.messages(i);
      for (MessagePlace place : places) {
        place.file = file;
        add_message(number, place);
      }
      count_messages(number, topic.message_count - places.size());
    }
  }

  std::vector<std::unique_ptr<MessageSource>> files_;
};

std::unique_ptr<MessageSource> open_file(const fs::path& file) {
  if (begins_with(ByteFile(file), kZstdFileMagic)) {
    const TemporaryFolder folder;
    const fs::path plain = folder.path() / file.stem();
    decompress_file(file, Compression::kZstd, plain);
    const BagForm* form = form_of(plain);
    if (form == nullptr) fail(file, "does not hold a bag");
    return form->open(plain);
  }
  const BagForm* form = form_of(file);
  if (form == nullptr) fail(file, "is not a bag: its first bytes are those of no known form");
  return form->open(file);
}

}  // namespace

bool holds_messages(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return !bag_files(path).empty();
  if (!fs::is_regular_file(path, error)) return false;
  const bool is_packed_bag =
      lower_case(path.extension().string()) == kZstdFileExtension && has_bag_extension(path.stem());
  return has_bag_extension(path) || is_packed_bag || form_of(path) != nullptr;
}

std::unique_ptr<MessageSource> open_messages(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return open_file(path);
  const std::vector<fs::path> files = bag_files(path);
  if (files.empty()) fail(path, "holds no bag");
  if (files.size() == 1) return open_file(files.front());
  if (!are_splits(files)) {
    std::string names;
    for (const fs::path& file : files) {
      names += (names.empty() ? "" : ", ") + file.filename().string();
    }
    fail(path, "holds several bags: " + names +
                   "; name one of them (files of one recording end in _0, _1, ...)");
  }
  std::vector<std::unique_ptr<MessageSource>> sources;
  sources.reserve(files.size());
  for (const fs::path& file : files) sources.push_back(open_file(file));
  return std::make_unique<SplitSource>(std::move(sources));
}

}  // namespace unimapper::datasets::bag
