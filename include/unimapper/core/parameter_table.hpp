// Parameter tables: range, unit, source and meaning of every member of a configuration struct.
//
// A configuration struct declares its members; the function `parameters_of` right behind it gives
// each of them a row; it is a template so that only who uses the table makes the compiler evaluate
// it. Range checks, JSON, the C setter and docs/parameters.md come from these rows. The compiler
// takes the names from the members themselves and counts them: a member without a row does not
// compile.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

#include "unimapper/core/decimal.hpp"
#include "unimapper/core/expected.hpp"

namespace unimapper {

/// Converts to any member.
struct AnyMember {
  template <typename T>
  operator T() const;  // NOLINT: implicit by design, never called
};

/// Members of the aggregate `T`: the most values it can be initialised with.
template <typename T, typename... Members>
consteval std::size_t member_count() {
  if constexpr (requires { T{Members{}..., AnyMember{}}; }) {
    return member_count<T, Members..., AnyMember>();
  } else {
    return sizeof...(Members);
  }
}

/// Which values a parameter takes.
enum class ParameterKind : std::uint8_t {
  kSwitch,  ///< bool
  kCount,   ///< std::uint32_t
  kFloat,
  kDouble,
  kChoice,  ///< an enum of one byte, by name
};

/// Numbers from `low` to `high`; NaN is never among them.
struct ParameterRange {
  double low = 0.0;          ///< smallest allowed value
  double high = 0.0;         ///< largest allowed value
  bool without_low = false;  ///< `low` itself is not among them
  bool or_zero = false;      ///< 0 is, although it lies outside
};

/// One row of a table.
struct Parameter {
  BoundedText<56> name;  ///< the member's, with dots behind the structs it lies in
  ParameterKind kind = ParameterKind::kCount;         ///< type of the member
  void* (*address)(void* config) noexcept = nullptr;  ///< of the member
  ParameterRange range;                               ///< allowed values of a number
  std::string_view range_text;  ///< e.g. "0 or [0.02, 2]"; empty for switches and choices
  std::string_view unit;        ///< empty: a plain number
  std::string_view source;      ///< where the default comes from
  std::string_view meaning;     ///< one sentence
  /// Names of a choice's values, in the order of the enum.
  std::span<const std::string_view> choices;
  BoundedText<136> refusal;  ///< the sentence for a value that is not allowed
};

/// Where a message of bounded length is put.
using ParameterMessage = BoundedText<192>;

namespace parameter_detail {

// Not for the compiler to evaluate: a table that calls one of them does not compile.
void malformed_range();
void malformed_table();

/// "[1, 32]", "(0, 1000]" or "0 or [0.02, 2]".
consteval ParameterRange parse_range(std::string_view text) {
  ParameterRange range;
  constexpr std::string_view kOrZero = "0 or ";
  if (text.starts_with(kOrZero)) {
    range.or_zero = true;
    text.remove_prefix(kOrZero.size());
  }
  const std::size_t comma = text.find(", ");
  if (comma == text.npos || text.back() != ']') malformed_range();
  range.without_low = text.front() == '(';
  if (!range.without_low && text.front() != '[') malformed_range();
  const auto low = parse_decimal(text.substr(1, comma - 1));
  const auto high = parse_decimal(text.substr(comma + 2, text.size() - comma - 3));
  if (!low || !high || *low >= *high) malformed_range();
  range.low = *low;
  range.high = *high;
  return range;
}

template <typename T>
struct MemberPointer;
template <typename Class, typename Value>
struct MemberPointer<Value Class::*> {
  using Config = Class;
  using Member = Value;
};
template <auto Pointer>
using ConfigOf = typename MemberPointer<decltype(Pointer)>::Config;
template <auto Pointer>
using MemberOf = typename MemberPointer<decltype(Pointer)>::Member;

/// The member's name, out of the text the compiler has for this function:
/// "... [with auto Pointer = &unimapper::GroundConfig::margin_m; ...]".
template <auto Pointer>
consteval std::string_view member_name() {
  std::string_view text = __PRETTY_FUNCTION__;
  text.remove_prefix(text.find("Pointer = ") + 1);
  text = text.substr(0, text.find_first_of(";])"));
  return text.substr(text.rfind("::") + 2);
}

template <auto Pointer>
void* member_address(void* config) noexcept {
  return &(static_cast<ConfigOf<Pointer>*>(config)->*Pointer);
}

template <typename T>
consteval ParameterKind kind_of() {
  if constexpr (std::is_same_v<T, bool>) {
    return ParameterKind::kSwitch;
  } else if constexpr (std::is_same_v<T, float>) {
    return ParameterKind::kFloat;
  } else if constexpr (std::is_same_v<T, double>) {
    return ParameterKind::kDouble;
  } else if constexpr (std::is_enum_v<T>) {
    static_assert(sizeof(T) == 1);
    return ParameterKind::kChoice;
  } else {
    static_assert(std::is_same_v<T, std::uint32_t>, "no parameter has this type");
    return ParameterKind::kCount;
  }
}

consteval BoundedText<136> refusal_of(const Parameter& row) {
  BoundedText<136> text;
  text.append(row.name.view());
  if (row.kind == ParameterKind::kSwitch) return text.append(" must be true or false");
  if (row.kind == ParameterKind::kChoice) {
    text.append(" must be one of");
    for (const std::string_view choice : row.choices) text.append(" ").append(choice);
    return text;
  }
  text.append(" must lie in ").append(row.range_text);
  if (!row.unit.empty()) text.append(" ").append(row.unit);
  if (text.full()) malformed_table();
  return text;
}

}  // namespace parameter_detail

/// The rows of a struct, and how many of its members they stand for.
template <std::size_t Rows>
struct ParameterRows {
  std::array<Parameter, Rows> rows;  ///< one per parameter
  std::size_t members = 1;           ///< members of the struct that the rows stand for
};

/// The row of a number: `range` as in "[1, 32]", "(0, 1000]" or "0 or [0.02, 2]".
template <auto Pointer>
consteval ParameterRows<1> parameter(const char* range, const char* unit, const char* source,
                                     const char* meaning) {
  using namespace parameter_detail;
  Parameter row;
  row.name.append(member_name<Pointer>());
  row.kind = kind_of<MemberOf<Pointer>>();
  row.address = &member_address<Pointer>;
  row.range_text = range;
  row.range = parse_range(range);
  row.unit = unit;
  row.source = source;
  row.meaning = meaning;
  return {{row}};
}

/// The row of a switch, or of a choice, whose names `choices_of(const Choice*)` lists.
template <auto Pointer>
consteval ParameterRows<1> parameter(const char* source, const char* meaning) {
  using namespace parameter_detail;
  using Member = MemberOf<Pointer>;
  Parameter row;
  row.name.append(member_name<Pointer>());
  row.kind = kind_of<Member>();
  row.address = &member_address<Pointer>;
  row.source = source;
  row.meaning = meaning;
  if constexpr (std::is_enum_v<Member>) {
    row.choices = choices_of(static_cast<const Member*>(nullptr));
  } else {
    static_assert(std::is_same_v<Member, bool>, "numbers need a range");
  }
  return {{row}};
}

/// The row of a number that code sets for code, e.g. the merger for its loop search. Its range is
/// checked; no file, C program or document knows it.
template <auto Pointer>
consteval ParameterRows<1> internal_parameter(const char* range, const char* unit = "") {
  return parameter<Pointer>(range, unit, "", "");
}

/// A member that is no parameter, e.g. a clock.
template <auto Pointer>
consteval ParameterRows<0> no_parameter() {
  return {};
}

/// The table of a struct, made of the parts that stand for its members, in their order.
template <std::size_t... Rows>
consteval ParameterRows<(Rows + ... + 0)> parameter_table(const ParameterRows<Rows>&... parts) {
  ParameterRows<(Rows + ... + 0)> table;
  std::size_t next = 0;
  const auto append = [&](const auto& part) {
    for (const Parameter& row : part.rows) table.rows[next++] = row;
  };
  (append(parts), ...);
  table.members = sizeof...(parts);
  return table;
}

namespace parameter_detail {

template <typename Config>
consteval auto checked_rows() {
  constexpr auto kTable = parameters_of(static_cast<const Config*>(nullptr));
  static_assert(kTable.members == member_count<Config>(), "every member needs its row");
  auto rows = kTable.rows;
  // Those with a meaning first: users know them alone.
  std::size_t next = 0;
  for (const bool is_public : {true, false}) {
    for (const Parameter& row : kTable.rows) {
      if (row.meaning.empty() != is_public) rows[next++] = row;
    }
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (rows[i].name.view() == rows[k].name.view()) malformed_table();
    }
    rows[i].refusal = refusal_of(rows[i]);
  }
  return rows;
}

}  // namespace parameter_detail

/// All rows of a configuration struct, those of the structs in it and internal ones included.
template <typename Config>
inline constexpr auto kCheckedParameters = parameter_detail::checked_rows<Config>();

namespace parameter_detail {

template <typename Config>
consteval std::size_t public_rows() {
  std::size_t count = 0;
  for (const Parameter& row : kCheckedParameters<Config>) count += row.meaning.empty() ? 0 : 1;
  return count;
}

}  // namespace parameter_detail

/// The parameters that users set and documents list: all rows but the internal ones.
template <typename Config>
inline constexpr std::span<const Parameter> kParameters =
    std::span(kCheckedParameters<Config>).first(parameter_detail::public_rows<Config>());

namespace parameter_detail {

template <auto Group, std::size_t Row>
void* address_in_group(void* config) noexcept {
  constexpr auto kInner = kCheckedParameters<MemberOf<Group>>[Row].address;
  return kInner(&(static_cast<ConfigOf<Group>*>(config)->*Group));
}

}  // namespace parameter_detail

/// The rows of a member that is a configuration struct itself.
template <auto Group>
consteval auto parameters_in() {
  using namespace parameter_detail;
  constexpr auto& kInner = kCheckedParameters<MemberOf<Group>>;
  ParameterRows<kInner.size()> part;
  part.rows = kInner;
  for (Parameter& row : part.rows) {
    const auto name = row.name;
    row.name = {};
    row.name.append(member_name<Group>()).append(".").append(name.view());
    if (row.name.full()) malformed_table();
  }
  [&]<std::size_t... Row>(std::index_sequence<Row...>) {
    ((part.rows[Row].address = &address_in_group<Group, Row>), ...);
  }
  (std::make_index_sequence<kInner.size()>{});
  return part;
}

/// Switches as 0 and 1, choices as their number.
[[nodiscard]] double value_of(const Parameter& parameter, const void* config) noexcept;

/// The value as `set_parameter` reads it: "true", "0.2", "only_same".
[[nodiscard]] ParameterMessage text_of(const Parameter& parameter, const void* config) noexcept;

/// Sets a parameter. Switches take true, false, 1 and 0, choices one of their names. False if the
/// text is no such value or out of range; `message` says why, and nothing has changed.
[[nodiscard]] bool set_parameter(const Parameter& parameter, std::string_view text, void* config,
                                 ParameterMessage& message) noexcept;

/// The parameter called `name`, or null.
[[nodiscard]] const Parameter* find_parameter(std::span<const Parameter> table,
                                              std::string_view name) noexcept;

/// The parameter whose name is most like a misspelt one, or null if none is.
[[nodiscard]] const Parameter* similar_parameter(std::span<const Parameter> table,
                                                 std::string_view name) noexcept;

/// "removal.windw is no parameter; did you mean removal.window?"
[[nodiscard]] ParameterMessage unknown_parameter(std::span<const Parameter> table,
                                                 std::string_view name) noexcept;

/// The first parameter that is out of its range, or null.
[[nodiscard]] const Parameter* first_out_of_range(std::span<const Parameter> table,
                                                  const void* config) noexcept;

/// `kOk`, or which member is out of its range, by name.
template <typename Config>
[[nodiscard]] Error check_ranges(const Config& config) noexcept {
  const Parameter* const wrong = first_out_of_range(kCheckedParameters<Config>, &config);
  if (wrong == nullptr) return {};
  return {ErrorCode::kInvalidConfig, wrong->refusal.c_str()};
}

}  // namespace unimapper
