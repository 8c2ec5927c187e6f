// Comparison of results in words with files of expected results
#pragma once

#include <string>

namespace unimapper::regression {

/// Fails, and shows the lines that differ, unless `text` is what expected/NAME.txt holds. What was
/// found is left in the build folder as actual/NAME.txt. With UNIMAPPER_UPDATE_EXPECTED=1 in the
/// environment the expected file is written instead (docs/testing.md).
void check_expected(const std::string& name, const std::string& text);

/// The same for results of an optimisation. A build with a sanitizer ends a millimetre apart from
/// the others: there, numbers may differ by 0.02 and two in a thousand, and sums by a hundredth of
/// the largest of their line.
void check_expected_of_optimisation(const std::string& name, const std::string& text);

/// The lines in which two texts differ, "-" before those of `expected`, "+" before those of
/// `actual`; empty if they are equal.
[[nodiscard]] std::string difference(const std::string& expected, const std::string& actual);

}  // namespace unimapper::regression
