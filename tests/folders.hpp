// Source and recordings folders of the tests.
#pragma once

namespace unimapper::testing {

// Compiled into one file only, so that a build elsewhere finds every other file unchanged in a
// compiler cache.

/// Absolute path of the project's sources.
const char* source_folder() noexcept;
/// Absolute path under the build folder where recordings are unpacked.
const char* recordings_folder() noexcept;

}  // namespace unimapper::testing
