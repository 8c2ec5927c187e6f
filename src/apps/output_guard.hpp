// Protection of earlier results from being overwritten.
#pragma once

#include <cstdint>
#include <filesystem>

namespace unimapper::apps {

/// What a command writes into a folder.
enum class Output : std::uint8_t {
  kRun,        ///< `onboard`
  kMap,        ///< `merge`
  kRecording,  ///< `simulate`
  kPictures,   ///< `evaluate dynamic --pictures`
};

/// Checks that `output` may be written to `folder`, before any work is done. One of the same kind
/// is kept unless `replaces`; one of another kind, whose files have the same names, is kept in any
/// case, as are scans that were not simulated and labels that may be somebody's ground truth.
/// Nothing is changed. Throws std::runtime_error with what to do.
void check_output_folder(const std::filesystem::path& folder, Output output, bool replaces);

/// Checks that `folder` is not the recording `dataset`, and neither among its scans nor above them:
/// a run there would pass for a part of it. Throws std::runtime_error.
void check_outside_recording(const std::filesystem::path& folder,
                             const std::filesystem::path& dataset);

/// Checks that `file` may be written, before any work is done. Throws std::runtime_error where it
/// exists, unless `replaces`, and where it is a folder or a device.
void check_output_file(const std::filesystem::path& file, bool replaces);

/// Removes what an earlier command wrote to `folder` as `output`, so that nothing of it is left
/// beside newer files. Other files stay. To be called after the check. Throws DatasetError where a
/// folder is unreadable.
void remove_earlier_output(const std::filesystem::path& folder, Output output);

/// Whether a folder holds an earlier output of that kind.
bool holds_output(const std::filesystem::path& folder, Output output);

/// Whether a path relative to a folder with that output names one of its files.
bool is_output_file(const std::filesystem::path& relative, Output output);

/// Whether the output has files in a folder of that name.
bool is_output_folder(const std::filesystem::path& name, Output output);

}  // namespace unimapper::apps
