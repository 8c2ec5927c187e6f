// Parameter tables as Markdown.
#include "unimapper/config/config_json.hpp"

namespace unimapper {
namespace {

std::string_view struct_of(const Parameter& parameter) {
  const std::string_view name = parameter.name.view();
  const std::size_t dot = name.rfind('.');
  return dot == std::string_view::npos ? std::string_view{} : name.substr(0, dot);
}

std::string range_of(const Parameter& parameter) {
  if (parameter.kind == ParameterKind::kSwitch) return "true, false";
  std::string names;
  for (const std::string_view choice : parameter.choices) {
    names.append(names.empty() ? "" : ", ").append(choice);
  }
  return names.empty() ? std::string(parameter.range_text) : names;
}

std::string row_of(const Parameter& parameter, const void* config) {
  std::string row = "| `";
  row.append(parameter.name.view()).append("` | ").append(text_of(parameter, config).view());
  row.append(" | ").append(range_of(parameter)).append(" | ").append(parameter.unit);
  row.append(" | ").append(parameter.meaning).append(" | ").append(parameter.source);
  return row + " |\n";
}

}  // namespace

std::string parameters_as_markdown(std::span<const Parameter> table, const void* config) {
  std::string text;
  std::string_view current = "-";
  for (const Parameter& parameter : table) {
    if (struct_of(parameter) != current) {
      current = struct_of(parameter);
      text.append("\n### ").append(current.empty() ? "outside of the structs" : current);
      text.append("\n\n| name | default | range | unit | meaning | source |\n");
      text.append("|---|---|---|---|---|---|\n");
    }
    text += row_of(parameter, config);
  }
  return text;
}

}  // namespace unimapper
