// Random values for the members of a configuration struct, through its parameter table.
#pragma once

#include "tests/test.hpp"
#include "unimapper/core/parameter_table.hpp"

namespace unimapper::test {

class RandomParameters {
 public:
  explicit RandomParameters(std::uint32_t seed) : random_(seed) {}

  /// Sets one to eight parameters to anything at all: mostly within their range, sometimes at its
  /// ends, beyond them or no number.
  void change_some(std::span<const Parameter> table, void* config) {
    const std::uint32_t changes = 1 + random_() % 8;
    for (std::uint32_t i = 0; i < changes; ++i) change(table[random_() % table.size()], config);
  }

 private:
  double share() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }

  double number(const ParameterRange& range) {
    switch (random_() % 32) {
      case 0:
        return range.low;
      case 1:
        return range.high;
      case 2:
        return 0.0;
      case 3:
        return range.low - (range.high - range.low) * share();
      case 4:
        return range.high + (range.high - range.low) * share();
      case 5:
        return std::numeric_limits<double>::quiet_NaN();
      case 6:
        return std::numeric_limits<double>::infinity();
      default:
        // Small numbers as often as large ones.
        return range.low + (range.high - range.low) * std::pow(share(), 1 + random_() % 16);
    }
  }

  void change(const Parameter& parameter, void* config) {
    void* const member = parameter.address(config);
    const double value = number(parameter.range);
    switch (parameter.kind) {
      case ParameterKind::kSwitch:
        *static_cast<bool*>(member) = random_() % 2 == 0;
        break;
      case ParameterKind::kChoice:
        *static_cast<std::uint8_t*>(member) = static_cast<std::uint8_t>(random_() % 4);
        break;
      case ParameterKind::kFloat:
        *static_cast<float*>(member) = static_cast<float>(value);
        break;
      case ParameterKind::kDouble:
        *static_cast<double*>(member) = value;
        break;
      case ParameterKind::kCount:
        *static_cast<std::uint32_t*>(member) =
            value >= 0.0 && value <= 4294967295.0 ? static_cast<std::uint32_t>(value) : 4294967295U;
        break;
    }
  }

  std::mt19937 random_;
};

/// Whether a refusal says which parameter it is about.
inline bool names_a_parameter(std::span<const Parameter> table, const std::string& message) {
  return std::any_of(table.begin(), table.end(), [&](const Parameter& parameter) {
    return message.find(parameter.name.view()) != std::string::npos;
  });
}

}  // namespace unimapper::test
