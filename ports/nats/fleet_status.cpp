#include "ports/nats/fleet_status.hpp"

#include <functional>
#include <nlohmann/json.hpp>

#include "ports/nats/connection.hpp"
#include "ports/nats/subjects.hpp"

namespace unimapper::nats_port {

namespace {

using Info = std::unique_ptr<jsStreamInfo, Destroyer<&jsStreamInfo_Destroy>>;

/// A stream with its subjects.
Info stream(const Connection& connection, const char* name) {
  jsOptions options;
  require(jsOptions_Init(&options), name);
  options.Stream.Info.SubjectsFilter = ">";
  jsStreamInfo* info = nullptr;
  require(js_GetStreamInfo(&info, connection.jetstream(), name, &options, nullptr), name);
  return Info(info);
}

void for_each_subject(const Info& info,
                      const std::function<void(const char*, std::uint64_t)>& take) {
  const jsStreamStateSubjects* const subjects = info->State.Subjects;
  for (int i = 0; subjects != nullptr && i < subjects->Count; ++i) {
    take(subjects->List[i].Subject, subjects->List[i].Msgs);
  }
}

void read_stream(const Connection& connection, FleetStatus& status) {
  const Info info = stream(connection, kKeyframeStream);
  status.messages = info->State.Msgs;
  status.bytes = info->State.Bytes;
  if (info->Config->MaxBytes > 0) {
    status.max_bytes = static_cast<std::uint64_t>(info->Config->MaxBytes);
  } else {
    jsAccountInfo* account = nullptr;
    require(js_GetAccountInfo(&account, connection.jetstream(), nullptr, nullptr), "the account");
    if (account->Limits.MaxStore > 0) {
      status.max_bytes = static_cast<std::uint64_t>(account->Limits.MaxStore);
    }
    jsAccountInfo_Destroy(account);
  }
  for_each_subject(info, [&status](const char* text, std::uint64_t messages) {
    const auto subject = parse_subject(text);
    if (!subject) return;
    SiteStatus& site = status.sites[subject->site];
    (subject->sequence ? site.keyframes : site.sessions) += messages;
  });
}

void read_centre(const Connection& connection, FleetStatus& status) {
  jsConsumerInfo* info = nullptr;
  const natsStatus found =
      js_GetConsumerInfo(&info, connection.jetstream(), kKeyframeStream, kCentre, nullptr, nullptr);
  if (found == NATS_NOT_FOUND) {
    status.pending = status.messages;
    return;
  }
  require(found, "the centre");
  status.has_centre = true;
  status.pending = info->NumPending;
  status.unanswered = static_cast<std::uint64_t>(info->NumAckPending);
  status.redelivered = static_cast<std::uint64_t>(info->NumRedelivered);
  jsConsumerInfo_Destroy(info);
}

void read_site(const Connection& connection, const char* subject, FleetStatus& status) {
  const std::string text(subject);
  const std::string name = text.substr(10, text.size() - 17);  // unimapper.NAME.status
  if (!is_site_name(name)) return;
  natsMsg* last = nullptr;
  require(js_GetLastMsg(&last, connection.jetstream(), kSiteStream, subject, nullptr, nullptr),
          "a site");
  const Message message(last);
  SiteStatus& site = status.sites[name];
  site.heard_ns = natsMsg_GetTime(last);
  const char* const data = natsMsg_GetData(last);
  const auto json = nlohmann::json::parse(data, data + natsMsg_GetDataLength(last), nullptr, false);
  const auto number = [&json](const char* key) -> std::uint64_t {
    const bool is_there = json.is_object() && json.contains(key) && json[key].is_number_unsigned();
    return is_there ? json[key].get<std::uint64_t>() : 0;
  };
  site.waiting = number("waiting");
  site.too_large = number("too_large");
  site.damaged = number("damaged");
  site.failures = number("failures_since_start");
}

}  // namespace

FleetStatus fleet_status(const Server& server) {
  const Connection connection(server);
  connection.require_streams();
  FleetStatus status;
  read_stream(connection, status);
  read_centre(connection, status);
  for_each_subject(stream(connection, kSiteStream), [&](const char* subject, std::uint64_t) {
    read_site(connection, subject, status);
  });
  return status;
}

}  // namespace unimapper::nats_port
