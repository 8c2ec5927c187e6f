// Every configuration member by a name and an access that the tests write down themselves.
#pragma once

#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include "unimapper/core/parameter_table.hpp"

namespace unimapper::test {

template <typename Config>
struct Member {
  const char* name;
  double (*value)(const Config& config);
};

template <typename T>
double as_number(T value) {
  if constexpr (std::is_same_v<T, bool>) {
    return value ? 1.0 : 0.0;
  } else {
    return static_cast<double>(value);
  }
}

/// The expression that reads a member is its name.
#define UNIMAPPER_MEMBER(path)                                       \
  {                                                                  \
#path, [](const auto& config) { return as_number(config.path); } \
  }

/// For every member: after `set(config, name, text)` this member alone has changed, to that value.
/// Returns the names of members for which it was not so, and of those not listed.
template <typename Config, typename Set>
std::vector<std::string> wrong_members(const std::vector<Member<Config>>& members, const Set& set) {
  std::vector<std::string> wrong;
  const Config before;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const Parameter* const row = find_parameter(kParameters<Config>, members[i].name);
    if (row == nullptr) {
      wrong.push_back(std::string(members[i].name) + " has no row");
      continue;
    }
    // A value of its own: no two members get the same, none its default.
    double value = members[i].value(before) == 0.0 ? 1.0 : 0.0;
    std::string text =
        row->kind == ParameterKind::kSwitch ? (value == 0.0 ? "false" : "true") : "only_same";
    if (row->kind != ParameterKind::kSwitch && row->kind != ParameterKind::kChoice) {
      const double share = (static_cast<double>(i) + 1.0) / static_cast<double>(members.size() + 2);
      value = row->range.low + share * (row->range.high - row->range.low);
      if (row->kind == ParameterKind::kCount) value = static_cast<std::uint32_t>(value);
      if (value == members[i].value(before)) value += 1.0;
      if (row->kind == ParameterKind::kFloat)
        value = static_cast<double>(static_cast<float>(value));
      text = row->kind == ParameterKind::kDouble ? std::string(decimal_of(value).view())
             : row->kind == ParameterKind::kFloat
                 ? std::string(decimal_of(static_cast<float>(value)).view())
                 : std::to_string(static_cast<std::uint32_t>(value));
    }
    Config after = before;
    set(after, members[i].name, text);
    for (std::size_t k = 0; k < members.size(); ++k) {
      const double expected = k == i ? value : members[k].value(before);
      const double slack = row->kind == ParameterKind::kDouble ? 1e-14 * expected : 0.0;
      const double is = members[k].value(after);
      if (is < expected - slack || is > expected + slack) {
        wrong.push_back(std::string(members[i].name) + " = " + text + ": " + members[k].name);
      }
    }
  }
  if (members.size() != kParameters<Config>.size()) wrong.emplace_back("a member is not listed");
  return wrong;
}

}  // namespace unimapper::test
