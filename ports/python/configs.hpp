// Configurations in Python: parameters by name, as their tables have them.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <span>
#include <stdexcept>
#include <string>

#include "ports/python/arrays.hpp"
#include "unimapper/config/config_json.hpp"
#include "unimapper/core/parameter_table.hpp"

namespace unimapper::python {

/// The value of a parameter as a bool, int, float or str. Throws KeyError.
[[nodiscard]] py::object get_parameter(std::span<const Parameter> table, const std::string& name,
                                       const void* config);
/// Sets a parameter. Throws KeyError for an unknown name and ValueError for a wrong value.
void put_parameter(std::span<const Parameter> table, const std::string& name,
                   const py::object& value, void* config);
/// Range, unit, source and meaning of a parameter. Throws KeyError.
[[nodiscard]] py::dict describe_parameter(std::span<const Parameter> table,
                                          const std::string& name);
/// The names of all parameters.
[[nodiscard]] py::list parameter_names(std::span<const Parameter> table);

/// A clock for stage times and budgets, where the configuration has one.
template <typename Config>
Config with_clock(Config config) {
  if constexpr (requires { config.clock_ns; }) {
    config.clock_ns = [] {
      return std::int64_t{
          std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count()};
    };
  }
  return config;
}

/// A class for a configuration that behaves as a mapping of its parameters.
template <typename Config>
py::class_<Config> bind_config(py::module_& module, const char* name, const std::string& doc) {
  static constexpr auto kTable = [] { return std::span<const Parameter>(kParameters<Config>); };
  const std::string full = doc +
                           "\n\nA mapping of parameters by name. `describe` tells range, unit and "
                           "meaning;\ndocs/parameters.md lists all. Values out of range are "
                           "refused with ValueError.";
  return py::class_<Config>(module, name, full.c_str())
      .def(py::init([] { return with_clock(Config{}); }))
      .def("__getitem__",
           [](const Config& config, const std::string& key) {
             return get_parameter(kTable(), key, &config);
           })
      .def("__setitem__",
           [](Config& config, const std::string& key, const py::object& value) {
             put_parameter(kTable(), key, value, &config);
           })
      .def("__len__", [](const Config&) { return kTable().size(); })
      .def("__iter__", [](const Config&) { return py::iter(parameter_names(kTable())); })
      .def(
          "keys", [](const Config&) { return parameter_names(kTable()); },
          "Names of all parameters, e.g. \"removal.window\".")
      .def(
          "describe",
          [](const Config&, const std::string& key) { return describe_parameter(kTable(), key); },
          py::arg("name"), "Range, unit, source and meaning of a parameter, as a dict.")
      .def(
          "to_json", [](const Config& config) { return dump_config(config); },
          "All parameters as the tool's --dump-config prints them.")
      .def(
          "read_json",
          [](Config& config, const std::string& text) {
            Config read = config;
            try {
              parse_config(text, "config", read);
            } catch (const std::runtime_error& error) {
              throw py::value_error(error.what());
            }
            config = read;
          },
          py::arg("text"), "Overwrites the parameters that a JSON object names, or none.")
      .def(
          "validate", [](const Config& config) { require_ok(config.validate()); },
          "Raises ValueError with the first thing that is wrong.")
      .def("__copy__", [](const Config& config) { return Config(config); })
      .def("__deepcopy__", [](const Config& config, const py::dict&) { return Config(config); })
      .def("__repr__", [name = std::string(name)](const Config& config) {
        return "unimapper." + name + " " + dump_config(config);
      });
}

}  // namespace unimapper::python
