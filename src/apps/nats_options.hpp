// Options of commands that connect to NATS servers.
#pragma once

#include <CLI/CLI.hpp>

#include "ports/nats/server.hpp"

namespace unimapper::apps {

/// How the command shows a server who it is; `server` must live as long as `command`.
inline void add_nats_credentials(CLI::App& command, nats_port::Server& server) {
  const auto add = [&command](const char* name, std::filesystem::path& file, const char* text) {
    command.add_option(name, file, text)->group("Fleet (docs/fleet.md)");
  };
  add("--nats-credentials", server.credentials,
      "File with USER:PASSWORD, an NKEY's seed and public key, or .creds file");
  add("--nats-ca", server.ca, "Certificates that the server's must come from (TLS)");
  add("--nats-certificate", server.certificate, "Certificate that the server wants to see (TLS)");
  add("--nats-key", server.key, "Its secret key");
}

}  // namespace unimapper::apps
