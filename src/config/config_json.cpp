// JSON reader and writer for parameter tables.
#include "unimapper/config/config_json.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace unimapper {
namespace {

/// Sets what a JSON object names.
class Reader {
 public:
  Reader(const std::string& source, std::span<const Parameter> table, void* config)
      : source_(source), table_(table), config_(config) {}

  /// `path`: the key of `object`, with a dot behind it unless it is the whole file.
  void read(const nlohmann::json& object, const std::string& path) const {
    for (const auto& [key, value] : object.items()) {
      const std::string name = path + key;
      if (const Parameter* const parameter = find_parameter(table_, name)) {
        set(*parameter, value);
      } else if (!is_struct(name)) {
        refuse(unknown_parameter(table_, name).c_str());
      } else if (!value.is_object()) {
        refuse(name + " must be an object");
      } else {
        read(value, name + ".");
      }
    }
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw std::runtime_error(source_ + ": " + what);
  }

 private:
  [[nodiscard]] bool is_struct(const std::string& name) const {
    return std::any_of(table_.begin(), table_.end(), [&](const Parameter& parameter) {
      return parameter.name.view().starts_with(name + ".");
    });
  }

  void set(const Parameter& parameter, const nlohmann::json& value) const {
    const bool is_text = parameter.kind == ParameterKind::kChoice;
    const bool fits = is_text                                    ? value.is_string()
                      : parameter.kind == ParameterKind::kSwitch ? value.is_boolean()
                                                                 : value.is_number();
    ParameterMessage message;
    if (!fits) {
      message.append(parameter.name.view()).append(" is ").append(value.dump().substr(0, 40));
      message.append(" but").append(parameter.refusal.view().substr(parameter.name.view().size()));
      refuse(message.c_str());
    }
    const std::string text = is_text ? value.get<std::string>() : value.dump();
    if (!set_parameter(parameter, text, config_, message)) refuse(message.c_str());
  }

  const std::string& source_;
  std::span<const Parameter> table_;
  void* config_;
};

nlohmann::json parse_json(std::string_view text, const std::string& source) {
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::exception& error) {  // also of a number beyond all bounds
    const std::string what = error.what();
    const std::size_t prefix = what.find("] ");
    throw std::runtime_error(source + ": " +
                             (prefix == std::string::npos ? what : what.substr(prefix + 2)));
  }
}

nlohmann::ordered_json json_of(const Parameter& parameter, const void* config) {
  const double value = value_of(parameter, config);
  switch (parameter.kind) {
    case ParameterKind::kSwitch:
      return value != 0.0;
    case ParameterKind::kCount:
      return static_cast<std::uint32_t>(value);
    case ParameterKind::kFloat:
      // The shortest decimal that is the same float: 0.2, not 0.20000000298.
      return parse_decimal(text_of(parameter, config).view()).value_or(value);
    case ParameterKind::kChoice:
      return std::string(text_of(parameter, config).view());
    case ParameterKind::kDouble:
      break;
  }
  return value;
}

}  // namespace

void read_parameters(std::string_view text, const std::string& source,
                     std::span<const Parameter> table, void* config) {
  const nlohmann::json json = parse_json(text, source);
  const Reader reader(source, table, config);
  if (!json.is_object()) reader.refuse("the file must be an object");
  reader.read(json, "");
}

std::string write_parameters(std::span<const Parameter> table, const void* config) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const Parameter& parameter : table) {
    std::string pointer(1, '/');
    pointer += parameter.name.view();
    std::replace(pointer.begin(), pointer.end(), '.', '/');
    json[nlohmann::ordered_json::json_pointer(pointer)] = json_of(parameter, config);
  }
  return json.dump(2) + "\n";
}

}  // namespace unimapper
