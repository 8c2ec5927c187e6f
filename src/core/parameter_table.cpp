// Range checks, texts and name look-up by parameter table.
#include "unimapper/core/parameter_table.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

namespace unimapper {
namespace {

template <typename T>
T& member(const Parameter& parameter, void* config) noexcept {
  return *static_cast<T*>(parameter.address(config));
}
template <typename T>
const T& member(const Parameter& parameter, const void* config) noexcept {
  return *static_cast<const T*>(parameter.address(const_cast<void*>(config)));  // NOLINT: read only
}

// Floats are compared with the floats nearest to the bounds: 0.2F is not beyond 0.2. Written so
// that NaN is outside of everything.
template <typename T>
bool is_within(T value, const ParameterRange& range) noexcept {
  if (range.or_zero && value == T{0}) return true;
  const T low = static_cast<T>(range.low);
  const T high = static_cast<T>(range.high);
  return (range.without_low ? value > low : value >= low) && value <= high;
}

bool is_in_range(const Parameter& parameter, const void* config) noexcept {
  switch (parameter.kind) {
    case ParameterKind::kFloat:
      return is_within(member<float>(parameter, config), parameter.range);
    case ParameterKind::kDouble:
      return is_within(member<double>(parameter, config), parameter.range);
    case ParameterKind::kCount:
      return is_within(static_cast<double>(member<std::uint32_t>(parameter, config)),
                       parameter.range);
    case ParameterKind::kChoice:
      return member<std::uint8_t>(parameter, config) < parameter.choices.size();
    case ParameterKind::kSwitch:
      break;
  }
  return true;
}

bool set_switch(const Parameter& parameter, std::string_view text, void* config) noexcept {
  const bool on = text == "true" || text == "1";
  if (!on && text != "false" && text != "0") return false;
  member<bool>(parameter, config) = on;
  return true;
}

bool set_choice(const Parameter& parameter, std::string_view text, void* config) noexcept {
  const auto found = std::find(parameter.choices.begin(), parameter.choices.end(), text);
  if (found == parameter.choices.end()) return false;
  member<std::uint8_t>(parameter, config) =
      static_cast<std::uint8_t>(found - parameter.choices.begin());
  return true;
}

template <typename T>
bool set_number(const Parameter& parameter, double value, void* config) noexcept {
  // Written so that NaN is refused; a value beyond what T holds must not be converted.
  if (!(value >= -static_cast<double>(std::numeric_limits<float>::max()) &&
        value <= static_cast<double>(std::numeric_limits<float>::max()))) {
    return false;
  }
  if (!is_within(static_cast<T>(value), parameter.range)) return false;
  member<T>(parameter, config) = static_cast<T>(value);
  return true;
}

bool set_count(const Parameter& parameter, double value, void* config) noexcept {
  if (!is_within(value, parameter.range) || value < 0.0 || value > 4294967295.0) return false;
  const auto count = static_cast<std::uint32_t>(value);
  if (static_cast<double>(count) != value) return false;
  member<std::uint32_t>(parameter, config) = count;
  return true;
}

bool set_value(const Parameter& parameter, std::string_view text, void* config) noexcept {
  if (parameter.kind == ParameterKind::kSwitch) return set_switch(parameter, text, config);
  if (parameter.kind == ParameterKind::kChoice) return set_choice(parameter, text, config);
  const auto value = parse_decimal(text);
  if (!value) return false;
  if (parameter.kind == ParameterKind::kCount) return set_count(parameter, *value, config);
  return parameter.kind == ParameterKind::kFloat ? set_number<float>(parameter, *value, config)
                                                 : set_number<double>(parameter, *value, config);
}

/// "NAME is VALUE but must lie in ...", out of the sentence without the value.
ParameterMessage refusal_of(const Parameter& parameter, std::string_view value) noexcept {
  ParameterMessage message;
  message.append(parameter.name.view()).append(" is ").append(leading(value, 40)).append(" but");
  message.append(without_leading(parameter.refusal.view(), parameter.name.view().size()));
  return message;
}

/// Characters to insert, delete or replace to make one name of the other.
std::size_t edit_distance(std::string_view a, std::string_view b) noexcept {
  constexpr std::size_t kMost = 64;
  if (a.size() >= kMost || b.size() >= kMost) return SIZE_MAX;
  std::size_t row[kMost];
  for (std::size_t k = 0; k <= b.size(); ++k) row[k] = k;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t k = 1; k <= b.size(); ++k) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[k - 1] ? 0 : 1);
      diagonal = row[k];
      row[k] = std::min({row[k] + 1, row[k - 1] + 1, replaced});
    }
  }
  return row[b.size()];
}

std::string_view last_part(std::string_view name) noexcept {
  const std::size_t dot = name.rfind('.');
  return dot == std::string_view::npos ? name : without_leading(name, dot + 1);
}

}  // namespace

double value_of(const Parameter& parameter, const void* config) noexcept {
  switch (parameter.kind) {
    case ParameterKind::kFloat:
      return static_cast<double>(member<float>(parameter, config));
    case ParameterKind::kDouble:
      return member<double>(parameter, config);
    case ParameterKind::kCount:
      return static_cast<double>(member<std::uint32_t>(parameter, config));
    case ParameterKind::kChoice:
      return static_cast<double>(member<std::uint8_t>(parameter, config));
    case ParameterKind::kSwitch:
      break;
  }
  return member<bool>(parameter, config) ? 1.0 : 0.0;
}

ParameterMessage text_of(const Parameter& parameter, const void* config) noexcept {
  ParameterMessage text;
  switch (parameter.kind) {
    case ParameterKind::kFloat:
      return text.append(decimal_of(member<float>(parameter, config)).view());
    case ParameterKind::kDouble:
      return text.append(decimal_of(member<double>(parameter, config)).view());
    case ParameterKind::kCount:
      return text.append(decimal_of(member<std::uint32_t>(parameter, config)).view());
    case ParameterKind::kChoice: {
      const std::uint8_t choice = member<std::uint8_t>(parameter, config);
      return text.append(choice < parameter.choices.size() ? parameter.choices[choice] : "unknown");
    }
    case ParameterKind::kSwitch:
      break;
  }
  return text.append(member<bool>(parameter, config) ? "true" : "false");
}

bool set_parameter(const Parameter& parameter, std::string_view text, void* config,
                   ParameterMessage& message) noexcept {
  const bool done = set_value(parameter, text, config);
  message = done ? ParameterMessage{} : refusal_of(parameter, text);
  return done;
}

const Parameter* find_parameter(std::span<const Parameter> table, std::string_view name) noexcept {
  const auto found = std::find_if(table.begin(), table.end(),
                                  [&](const Parameter& row) { return row.name.view() == name; });
  return found == table.end() ? nullptr : &*found;
}

const Parameter* similar_parameter(std::span<const Parameter> table,
                                   std::string_view name) noexcept {
  const Parameter* similar = nullptr;
  std::size_t least = name.size() / 3 + 2;
  for (const Parameter& row : table) {
    const std::string_view known = row.name.view();
    // The right name in the wrong struct is a likely mistake.
    const bool only_misplaced = last_part(known) == last_part(name);
    const std::size_t distance = only_misplaced ? 1 : edit_distance(known, name);
    if (distance >= least) continue;
    least = distance;
    similar = &row;
  }
  return similar;
}

ParameterMessage unknown_parameter(std::span<const Parameter> table,
                                   std::string_view name) noexcept {
  ParameterMessage message;
  message.append(leading(name, 64)).append(" is no parameter");
  if (const Parameter* const similar = similar_parameter(table, name)) {
    message.append("; did you mean ").append(similar->name.view()).append("?");
  }
  return message;
}

const Parameter* first_out_of_range(std::span<const Parameter> table, const void* config) noexcept {
  const auto wrong = std::find_if(table.begin(), table.end(), [config](const Parameter& row) {
    return !is_in_range(row, config);
  });
  return wrong == table.end() ? nullptr : &*wrong;
}

}  // namespace unimapper
