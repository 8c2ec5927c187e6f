#include "ports/nats/connection.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "ports/nats/subjects.hpp"

namespace unimapper::nats_port {

namespace {

constexpr std::int64_t kConnectMs = 2000;
/// A server that has stopped to read must not hold up a sender for longer.
constexpr std::int64_t kWriteMs = 5000;
/// A link that is dead without a word is closed after two pings without an answer.
constexpr std::int64_t kPingMs = 10'000;
constexpr int kMaxPingsOut = 2;
/// Repetitions of a message within this time are one message.
constexpr std::int64_t kDuplicatesNs = 600'000'000'000;

using Options = std::unique_ptr<natsOptions, Destroyer<&natsOptions_Destroy>>;

/// "_INBOX", with the user where that is known and fits into a subject.
std::string inbox_prefix_of(const Server& server) {
  std::string user;
  if (const auto password = password_of(server.credentials)) {
    user = password->first;
  } else if (!server.credentials.empty() && server.credentials.extension() != ".creds") {
    for (const std::string& line : lines_of(server.credentials)) {
      if (line[0] == 'U') user = line;
    }
  } else {
    user = user_of(server);
  }
  return is_site_name(user) ? "_INBOX." + user : "_INBOX";
}

/// Of an NKEY the server wants the public key, which libnats does not make from the seed.
void use_credentials(natsOptions* options, const std::filesystem::path& file) {
  if (file.extension() == ".creds") {
    return require(natsOptions_SetUserCredentialsFromFiles(options, file.c_str(), nullptr),
                   file.string());
  }
  if (const auto password = password_of(file)) {
    return require(
        natsOptions_SetUserInfo(options, password->first.c_str(), password->second.c_str()),
        file.string());
  }
  const std::vector<std::string> lines = lines_of(file);
  const auto user = std::find_if(lines.begin(), lines.end(),
                                 [](const auto& line) { return line.substr(0, 1) == "U"; });
  if (lines.empty() || lines[0].substr(0, 2) != "SU" || user == lines.end()) {
    throw NatsError(
        file.string() +
        ": needs USER:PASSWORD, or the seed of an NKEY (SU...) and its public key (U...)");
  }
  require(natsOptions_SetNKeyFromSeed(options, user->c_str(), file.c_str()), file.string());
}

Options options_of(const Server& server) {
  check(server);
  natsOptions* made = nullptr;
  require(natsOptions_Create(&made), "NATS");
  Options options(made);
  const std::vector<std::string> all = addresses(server);
  std::vector<const char*> urls;
  for (const std::string& url : all) urls.push_back(url.c_str());
  require(natsOptions_SetServers(made, urls.data(), static_cast<int>(urls.size())), "addresses");
  require(natsOptions_SetTimeout(made, kConnectMs), "NATS");
  require(natsOptions_SetWriteDeadline(made, kWriteMs), "NATS");
  require(natsOptions_SetPingInterval(made, kPingMs), "NATS");
  require(natsOptions_SetMaxPingsOut(made, kMaxPingsOut), "NATS");
  require(natsOptions_SetCustomInboxPrefix(made, inbox_prefix_of(server).c_str()), "NATS");
  // Whoever uses it connects anew, and then looks again for what is to be done.
  require(natsOptions_SetAllowReconnect(made, false), "NATS");
  const bool is_tls = server.url.find("tls://") != std::string::npos || !server.ca.empty() ||
                      !server.certificate.empty();
  require(natsOptions_SetSecure(made, is_tls), "TLS");
  if (!server.ca.empty()) {
    require(natsOptions_LoadCATrustedCertificates(made, server.ca.c_str()), server.ca.string());
  }
  if (!server.certificate.empty()) {
    require(natsOptions_LoadCertificatesChain(made, server.certificate.c_str(), server.key.c_str()),
            server.certificate.string());
  }
  if (!server.credentials.empty()) use_credentials(made, server.credentials);
  return options;
}

/// Makes it where there is none; one that was made with other limits stays as it is.
void require_stream(jsCtx* jetstream, jsStreamConfig& config, bool may_be_hidden) {
  jsStreamInfo* info = nullptr;
  natsStatus status = js_GetStreamInfo(&info, jetstream, config.Name, nullptr, nullptr);
  if (status == NATS_NOT_FOUND) status = js_AddStream(&info, jetstream, &config, nullptr, nullptr);
  jsStreamInfo_Destroy(info);
  if (may_be_hidden && status == NATS_NO_RESPONDERS) return;
  require(status, std::string("the stream ") + config.Name);
}

}  // namespace

void require(natsStatus status, const std::string& what) {
  if (status == NATS_OK) return;
  natsStatus last = NATS_OK;
  const char* reason = nats_GetLastError(&last);
  const bool is_known = reason != nullptr && *reason != '\0' && last == status;
  std::string_view text = is_known ? reason : natsStatus_GetText(status);
  // Where in libnats that was.
  if (const std::size_t end = text.find("): "); text[0] == '(' && end != text.npos) {
    text.remove_prefix(end + 3);
  }
  throw NatsError(what + ": " + std::string(text));
}

Connection::Connection(const Server& server)
    : inbox_prefix_(inbox_prefix_of(server)), replicas_(addresses(server).size() < 3 ? 1 : 3) {
  const Options options = options_of(server);
  natsConnection* connection = nullptr;
  require(natsConnection_Connect(&connection, options.get()), shown(server));
  connection_.reset(connection);
  jsCtx* jetstream = nullptr;
  require(natsConnection_JetStream(&jetstream, connection, nullptr), shown(server));
  jetstream_.reset(jetstream);
}

std::string Connection::make_inbox() const {
  natsInbox* inbox = nullptr;
  require(natsInbox_Create(&inbox), "NATS");
  const std::string random = std::string(inbox).substr(std::string_view("_INBOX").size());
  natsInbox_Destroy(inbox);
  return inbox_prefix_ + random + ".";
}

bool Connection::is_open() const {
  return natsConnection_Status(connection_.get()) == NATS_CONN_STATUS_CONNECTED;
}

std::int64_t Connection::max_payload() const {
  return natsConnection_GetMaxPayload(connection_.get());
}

void Connection::publish(const std::string& subject, const std::string& text) const {
  require(natsConnection_PublishString(handle(), subject.c_str(), text.c_str()), "an answer");
}

void Connection::require_streams(bool may_be_hidden) const {
  std::array<const char*, 2> subjects{kKeyframeSubjects, kSessionSubjects};
  jsStreamConfig config;
  require(jsStreamConfig_Init(&config), "a stream");
  config.Name = kKeyframeStream;
  config.Subjects = subjects.data();
  config.SubjectsLen = static_cast<int>(subjects.size());
  config.Storage = js_FileStorage;
  // What the centre has stored leaves the stream; what does not fit stays at the site.
  config.Retention = js_WorkQueuePolicy;
  config.Discard = js_DiscardNew;
  config.Duplicates = kDuplicatesNs;
  config.Replicas = replicas_;
  // A site may not ask for that, but its messages may have their answers sent to where one asks.
  config.DenyPurge = true;
  config.DenyDelete = true;
  require_stream(jetstream(), config, may_be_hidden);
  std::array<const char*, 1> sites{kSiteSubjects};
  require(jsStreamConfig_Init(&config), "a stream");
  config.Name = kSiteStream;
  config.Subjects = sites.data();
  config.SubjectsLen = 1;
  config.Storage = js_FileStorage;
  config.MaxMsgsPerSubject = 1;
  config.Replicas = replicas_;
  config.DenyPurge = true;
  config.DenyDelete = true;
  require_stream(jetstream(), config, may_be_hidden);
}

}  // namespace unimapper::nats_port
