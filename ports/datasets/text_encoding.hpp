// Text files of other programs as plain text.
#pragma once

#include <filesystem>
#include <string>

namespace unimapper::datasets {

/// The text of a file without a byte-order mark, of UTF-16 as of UTF-8 (characters that are no
/// ASCII become `?` in it), with \n for line breaks, and with a point for a decimal comma.
/// A comma is decimal where no number has a point, columns are separated by something else, and no
/// column has two. Throws DatasetError.
[[nodiscard]] std::string read_text(const std::filesystem::path& file);

/// The text of bytes that were read, as `read_text` gives it. Throws DatasetError.
[[nodiscard]] std::string plain_text(std::string bytes);

}  // namespace unimapper::datasets
