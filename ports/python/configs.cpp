#include "ports/python/configs.hpp"

#include <string_view>

#include "ports/python/bindings.hpp"
#include "unimapper/core/sensor.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/odometry/config.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/place/config.hpp"

namespace unimapper::python {
namespace {

const Parameter& require_parameter(std::span<const Parameter> table, const std::string& name) {
  if (const Parameter* found = find_parameter(table, name)) return *found;
  throw py::key_error(std::string(unknown_parameter(table, name).view()));
}

/// As `set_parameter` reads it.
std::string parameter_text(const std::string& name, const py::object& value) {
  if (PyBool_Check(value.ptr())) return value.cast<bool>() ? "true" : "false";
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  if (PyIndex_Check(value.ptr())) return py::str(py::int_(value)).cast<std::string>();
  if (PyNumber_Check(value.ptr())) return py::repr(py::float_(value)).cast<std::string>();
  throw py::type_error(name + ": a bool, number or str is needed");
}

const SensorModel& require_sensor_model(const std::string& name) {
  if (const SensorModel* model = find_sensor(name)) return *model;
  std::string known;
  for (const SensorModel& model : sensor_models()) known += " " + std::string(model.name);
  throw py::value_error("unknown sensor '" + name + "'; known are" + known);
}

Computer computer_named(const std::string& name) {
  if (name == "server") return Computer::kServer;
  if (name == "jetson") return Computer::kJetson;
  if (name == "raspberry-pi") return Computer::kRaspberryPi;
  if (name == "armv7-64mb") return Computer::kArmv7With64Mb;
  throw py::value_error("unknown computer '" + name +
                        "'; known are server, jetson, raspberry-pi and armv7-64mb");
}

}  // namespace

py::object get_parameter(std::span<const Parameter> table, const std::string& name,
                         const void* config) {
  const Parameter& parameter = require_parameter(table, name);
  switch (parameter.kind) {
    case ParameterKind::kSwitch:
      return py::bool_(value_of(parameter, config) != 0.0);
    case ParameterKind::kCount:
      return py::int_(static_cast<std::uint32_t>(value_of(parameter, config)));
    case ParameterKind::kChoice:
      break;
    case ParameterKind::kFloat:
    case ParameterKind::kDouble:
      return py::float_(value_of(parameter, config));
  }
  return py::str(std::string(text_of(parameter, config).view()));
}

void put_parameter(std::span<const Parameter> table, const std::string& name,
                   const py::object& value, void* config) {
  const Parameter& parameter = require_parameter(table, name);
  ParameterMessage message;
  if (set_parameter(parameter, parameter_text(name, value), config, message)) return;
  throw py::value_error(std::string(message.view()));
}

py::dict describe_parameter(std::span<const Parameter> table, const std::string& name) {
  const Parameter& parameter = require_parameter(table, name);
  py::list choices;
  for (const std::string_view choice : parameter.choices) choices.append(std::string(choice));
  py::dict result;
  result["range"] = std::string(parameter.range_text);
  result["unit"] = std::string(parameter.unit);
  result["source"] = std::string(parameter.source);
  result["meaning"] = std::string(parameter.meaning);
  result["choices"] = choices;
  return result;
}

py::list parameter_names(std::span<const Parameter> table) {
  py::list names;
  for (const Parameter& parameter : table) names.append(std::string(parameter.name.view()));
  return names;
}

void bind_configs(py::module_& module) {
  bind_config<PipelineConfig>(module, "PipelineConfig",
                              "Parameters of `Pipeline`. `preset(sensor)` makes one.");
  bind_config<LidarOdometryConfig>(module, "LidarOdometryConfig", "Parameters of `LidarOdometry`.");
  bind_config<DescriptorConfig>(module, "DescriptorConfig", "Parameters of `PlaceDescriber`.");
  bind_config<LoopSearchConfig>(module, "LoopSearchConfig", "Parameters of `PlaceDatabase`.");
  bind_config<merge::MergeConfig>(module, "MergeConfig", "Parameters of `merge_sessions`.");
  module.def(
      "preset",
      [](const std::string& sensor, const std::string& computer) {
        return with_clock(preset(require_sensor_model(sensor).kind, computer_named(computer)));
      },
      py::arg("sensor"), py::arg("computer") = "server",
      "Recommended `PipelineConfig` for a LiDAR, e.g. \"os2-128\" (`sensors()` names all).\n"
      "computer: server, jetson, raspberry-pi or armv7-64mb.");
  module.def(
      "sensors",
      [] {
        py::list names;
        for (const SensorModel& model : sensor_models()) names.append(std::string(model.name));
        return names;
      },
      "Names of the LiDARs that have a preset.");
}

}  // namespace unimapper::python
