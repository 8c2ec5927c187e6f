// Comparison of results in words with files of expected results
#pragma once

#include <string>

namespace unimapper::regression {

/// Fails unless a text has the digest in expected/NAME.txt. That file also holds a summary: for
/// each of the twelve most frequent kinds of lines (equal but for their numbers) how many there are
/// and the mean of each number. A failure shows the lines of the summary that differ, and those of
/// the whole text if an earlier run of this build folder was good. Texts are left in
/// actual/NAME.txt and actual/good/NAME.txt of the build folder. With UNIMAPPER_UPDATE_EXPECTED=1
/// in the environment the expected file is written instead (docs/testing.md).
void check_expected(const std::string& name, const std::string& text);

/// `check_expected` for results of an optimisation. In a build with a sanitizer they end a
/// millimetre apart from the others and are not compared.
void check_expected_of_optimisation(const std::string& name, const std::string& text);

}  // namespace unimapper::regression
