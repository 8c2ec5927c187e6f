// `unimapper fleet`: what the server between sites and centre knows.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "ports/nats/fleet_status.hpp"
#include "src/apps/commands.hpp"
#include "src/apps/nats_options.hpp"
#include "src/apps/print.hpp"

namespace unimapper::apps {

namespace {

struct FleetOptions {
  nats_port::Server server;
  bool json = false;
};

double seconds_ago(std::int64_t unix_ns) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration<double>(now - std::chrono::nanoseconds(unix_ns)).count();
}

void print_json(const nats_port::FleetStatus& status) {
  nlohmann::ordered_json json;
  json["stream"] = {{"messages", status.messages}, {"bytes", status.bytes}};
  json["stream"]["max_bytes"] = nullptr;
  if (status.max_bytes) json["stream"]["max_bytes"] = *status.max_bytes;
  json["centre"] = {{"is_known", status.has_centre},
                    {"pending", status.pending},
                    {"unanswered", status.unanswered},
                    {"redelivered", status.redelivered}};
  json["sites"] = nlohmann::ordered_json::array();
  for (const auto& [name, site] : status.sites) {
    nlohmann::ordered_json one = {{"name", name},
                                  {"waiting_at_site", site.waiting},
                                  {"too_large", site.too_large},
                                  {"damaged", site.damaged},
                                  {"failures", site.failures},
                                  {"keyframes_in_stream", site.keyframes},
                                  {"sessions_in_stream", site.sessions}};
    one["heard_unix_ns"] = nullptr;
    if (site.heard_ns) one["heard_unix_ns"] = *site.heard_ns;
    json["sites"].push_back(one);
  }
  print_to(stdout, "{}\n", json.dump(2));
}

void print_text(const nats_port::FleetStatus& status) {
  constexpr double kMegabyte = 1e6;
  print_to(stdout, "stream: {} messages, {:.1f} MB", status.messages,
           static_cast<double>(status.bytes) / kMegabyte);
  if (status.max_bytes) {
    print_to(stdout, " of {:.0f} MB", static_cast<double>(*status.max_bytes) / kMegabyte);
  }
  print_to(stdout, "\ncentre: {}{} to be sent, {} without an answer, {} of them sent again\n",
           status.has_centre ? "" : "none has been there; ", status.pending, status.unanswered,
           status.redelivered);
  std::size_t width = 4;
  for (const auto& [name, site] : status.sites) width = std::max(width, name.size());
  print_to(stdout, "{:{}}  at the site  in the stream  failures  heard\n", "site", width);
  for (const auto& [name, site] : status.sites) {
    print_to(stdout, "{:{}}  {:11}  {:13}  {:8}  {}\n", name, width, site.waiting, site.keyframes,
             site.failures,
             site.heard_ns ? fmt::format("{:.0f} s ago", seconds_ago(*site.heard_ns))
                           : std::string("never"));
    if (site.too_large + site.damaged > 0) {
      print_to(stdout, "{:{}}  of these {} too large for the server, {} damaged\n", "", width,
               site.too_large, site.damaged);
    }
  }
}

}  // namespace

void register_fleet(CLI::App& app) {
  auto options = std::make_shared<FleetOptions>();
  CLI::App* command = app.add_subcommand("fleet", "Sites that send to a centre (docs/fleet.md)");
  command->require_subcommand(1);
  CLI::App* status =
      command->add_subcommand("status", "Say how far the uplinks of all sites and the centre are");
  status->add_option("--nats", options->server.url, "Servers: nats://HOST:PORT or tls://HOST:PORT")
      ->required();
  status->add_flag("--json", options->json, "As JSON");
  add_nats_credentials(*status, options->server);
  status->callback([options] {
    const nats_port::FleetStatus found = nats_port::fleet_status(options->server);
    options->json ? print_json(found) : print_text(found);
  });
}

}  // namespace unimapper::apps
