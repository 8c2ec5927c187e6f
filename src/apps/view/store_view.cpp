#include "src/apps/view/store_view.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "ports/store/health_reader.hpp"
#include "ports/store/store_reader.hpp"
#include "src/apps/map/stored_map.hpp"
#include "src/apps/map/stored_result.hpp"
#include "src/apps/map/stored_sessions.hpp"
#include "src/apps/view/health_view.hpp"
#include "src/apps/view/shown_merge.hpp"
#include "src/merge/sessions/keyframe_cache.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;

/// Nothing has changed for so long: the whole map is worth its time.
constexpr std::chrono::seconds kQuiet{5};
constexpr std::size_t kKeyframesAtOnce = 32;
constexpr std::size_t kEarlierEpochs = 3;
/// A page may still ask for keyframes of the epochs before.
constexpr std::size_t kEpochsBefore = 16;

Json describe(const store::Epoch& epoch) {
  return {{"number", epoch.number},
          {"parent", epoch.parent},
          {"made_s", epoch.made_s},
          {"command", epoch.command},
          {"outcome", epoch.outcome}};
}

/// Browsers keep answers for ever, and another process counts from one again.
std::string version_of(std::int64_t epoch, std::uint64_t version) {
  static const auto kStart_ms = std::chrono::duration_cast<std::chrono::milliseconds>(
                                    std::chrono::system_clock::now().time_since_epoch())
                                    .count();
  return std::to_string(epoch) + "." + std::to_string(kStart_ms) + "." + std::to_string(version);
}

/// What is said where there is nothing to see; null where there is.
Json notice_of(bool is_read, bool has_sessions) {
  if (!is_read) return "There is no store yet. It is shown as soon as a base has made it.";
  if (!has_sessions) return "No keyframe is stored yet. The first ones are shown as they arrive.";
  return nullptr;
}

Json index_or_null(std::optional<std::size_t> index) {
  return index ? Json(*index) : Json(nullptr);
}

std::string json_line(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

StoreView::StoreView(StoreViewOptions options)
    : options_(std::move(options)), contents_(options_.cache_bytes), robots_(options_.store) {
  look();
  RepeatedWorkOptions looking;
  looking.advance = [this] { return look(); };
  looking.works = "the page follows the store again";
  looking.fails = "the page does not follow the store";
  looking.report = options_.report;
  RepeatedWorkOptions completing = looking;
  completing.advance = [this] { return complete(); };
  completing.works = "the page shows the whole map again";
  completing.fails = "the page does not show the whole map";
  RepeatedWorkOptions watching = looking;
  watching.advance = [this] { return watch(); };
  watching.works = "the page watches the robots again";
  watching.fails = "the page does not watch the robots";
  looking_.emplace(std::move(looking));
  if (options_.epoch == 0) watching_.emplace(std::move(watching));
  completing_.emplace(std::move(completing));
}

StoreView::~StoreView() = default;

store::ProjectState StoreView::state_to_show() {
  store::StoreReader reader(options_.store);
  store::ProjectReader project = reader.project();
  return options_.epoch > 0 ? project.at(options_.epoch) : project.next();
}

/// Whether there is a store to follow.
bool StoreView::follows() {
  if (!follower_ && store::has_tables(options_.store)) follower_.emplace(options_.store);
  return follower_.has_value();
}

/// True: there may be more.
bool StoreView::look() {
  if (!follows() || !follower_->has_changed()) return false;
  const store::ProjectState state = state_to_show();
  bool is_other = false;
  {
    const std::lock_guard lock(mutex_);
    is_other = shown_.version == 0 || state.epoch.number != shown_.epoch ||
               state.epoch.result != shown_.result;
  }
  if (is_other) load(state);
  if (options_.epoch == 0) take_new_keyframes();
  return false;
}

/// False: the next look is due later.
bool StoreView::watch() {
  for (const AlarmChange& change : robots_.look()) {
    Json event = describe_alarm(change.alarm);
    event["state"] = change.is_over ? "over" : "raised";
    {
      const std::lock_guard lock(mutex_);
      event["session"] = index_or_null(index_of(change.alarm.session));
    }
    events().publish("alarm", json_line(event));
  }
  return false;
}

/// The number of a stored session on the page; none: it is not shown. Under `mutex_`.
std::optional<std::size_t> StoreView::index_of(std::int64_t row) const {
  const auto found = std::find(shown_.rows.begin(), shown_.rows.end(), row);
  if (found == shown_.rows.end()) return std::nullopt;
  return static_cast<std::size_t>(found - shown_.rows.begin());
}

/// Only what has arrived is read where the sessions are shown already.
void StoreView::read_sessions_of(const store::ProjectState& state, const store::MapResult& stored,
                                 Shown& shown) {
  std::vector<std::int64_t> rows = state.sessions;
  for (const store::SessionResult& session : stored.sessions) rows.push_back(session.session);
  std::sort(rows.begin(), rows.end());
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  if (!sessions_ || !sessions_->are_in(rows))
    sessions_.emplace(options_.store, options_.cache_bytes);
  sessions_->refresh(rows);
  std::vector<std::size_t> order(sessions_->rows().size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return sessions_->rows()[a] < sessions_->rows()[b];
  });
  for (const std::size_t s : order) {
    shown.sessions.push_back(without_descriptors(sessions_->sessions()[s]));
    shown.rows.push_back(sessions_->rows()[s]);
  }
}

/// The map of an epoch, with what has arrived since.
StoreView::Shown StoreView::read(const store::ProjectState& state, bool is_latest) {
  Shown next;
  next.epoch = state.epoch.number;
  next.result = state.epoch.result;
  next.is_read = true;
  next.statements = state.statements;
  store::MapResult stored;
  if (state.epoch.result != 0) {
    store::StoreReader reader(options_.store);
    stored = reader.project().result(state.epoch.result);
  }
  if (is_latest) {
    read_sessions_of(state, stored, next);
  } else {
    std::vector<std::int64_t> wanted = state.sessions;
    for (const store::SessionResult& session : stored.sessions) wanted.push_back(session.session);
    std::vector<InputSession> inputs =
        read_sessions(options_.store, wanted, {}, &contents_, SessionOrder::kArrival);
    for (const InputSession& input : inputs) next.rows.push_back(input.row);
    next.sessions = data_of(inputs);
  }
  const KeyframeRows rows(next.rows, next.sessions);
  if (state.epoch.result != 0) next.merged = grown_result(stored, rows);
  place_by_odometry(next.sessions, next.merged);
  return next;
}

void StoreView::load(const store::ProjectState& state) {
  Shown next = read(state, true);
  for (std::size_t s = 0; s < next.sessions.size(); ++s) {
    const auto& keyframes = next.sessions[s].keyframes;
    newest_[next.rows[s]] = keyframes.empty() ? -1 : keyframes.back().sequence;
  }
  std::string version;
  {
    const std::lock_guard lock(mutex_);
    next.version = shown_.version + 1;
    if (next.epoch != shown_.epoch) before_.emplace_back(shown_.epoch, shown_.rows);
    if (before_.size() > kEpochsBefore) before_.pop_front();
    if (!shown_.layers.empty()) {
      layers_before_ = {version_of(shown_.epoch, shown_.version), std::move(shown_.layers)};
    }
    shown_ = std::move(next);
    changed_ = Clock::now();
    version = version_of(shown_.epoch, shown_.version);
  }
  events().publish("map", Json{{"epoch", state.epoch.number}, {"version", version}}.dump());
}

void StoreView::take_new_keyframes() {
  for (const store::SessionExtent& extent : follower_->sessions()) {
    const auto newest = newest_.find(extent.row);
    // A session that is not shown yet; one that was taken out of the project never is.
    if (newest == newest_.end()) {
      load(state_to_show());
      newest_.try_emplace(extent.row, std::numeric_limits<std::int64_t>::max());
      continue;
    }
    while (newest->second < extent.newest) {
      const auto keyframes = follower_->keyframes(extent.row, newest->second + 1, kKeyframesAtOnce);
      if (keyframes.empty()) break;
      for (const store::StoredKeyframe& stored : keyframes) {
        newest->second = stored.sequence;
        take(extent.row, stored);
      }
    }
  }
}

void StoreView::take(std::int64_t row, const store::StoredKeyframe& stored) {
  if (!stored.is_sound) return;
  wire::DecodedKeyframe decoded = wire::decode_keyframe(stored.bytes);
  if (!decoded.record) return;
  merge::drop_contents(*decoded.record);
  Json event;
  const char* state = "not yet";
  {
    const std::lock_guard lock(mutex_);
    const std::optional<std::size_t> index = index_of(row);
    if (!index) return;
    const std::size_t s = *index;
    std::vector<KeyframeRecord>& keyframes = shown_.sessions[s].keyframes;
    std::vector<Pose>& poses = shown_.merged.sessions[s].T_map_keyframe;
    Pose T_map_odometry;
    if (!keyframes.empty()) {
      T_map_odometry = poses.back() * keyframes.back().T_odometry_keyframe.inverse();
    }
    poses.push_back(T_map_odometry * decoded.record->T_odometry_keyframe);
    keyframes.push_back(std::move(*decoded.record));
    if (!shown_.merged.sessions[s].refined.empty()) {
      shown_.merged.sessions[s].refined.emplace_back();
    }
    shown_.json.reset();
    changed_ = Clock::now();
    event = {{"session", s},
             {"name", shown_.sessions[s].info.name},
             {"keyframe", keyframes.size() - 1},
             {"sequence", keyframes.back().sequence},
             {"stamp_s", stamp_s(keyframes.back()) - stamp_s(keyframes.front())},
             {"pose", describe_pose(poses.back())}};
    const merge::SessionStatus status = shown_.merged.sessions[s].status;
    if (merge::is_in_map(status)) state = "localised";
    if (status == merge::SessionStatus::kProvisional) state = "ambiguous";
  }
  events().publish("keyframe", json_line(event));
  const std::optional<double> latency = robots_.latency_ms(row);
  const Json robot = {{"session", event["session"]},
                      {"name", event["name"]},
                      {"pose", event["pose"]},
                      {"state", state},
                      {"latency_ms", latency ? Json(*latency) : Json(nullptr)}};
  events().publish("robot", json_line(robot));
}

/// True: there is more to do at once.
bool StoreView::complete() {
  std::uint64_t version = 0;
  std::int64_t epoch = 0;
  {
    const std::lock_guard lock(mutex_);
    const bool is_due = !shown_.is_whole && shown_.is_asked_for && shown_.result != 0 &&
                        (options_.epoch > 0 || Clock::now() - changed_ > kQuiet);
    if (!is_due) return false;
    version = shown_.version;
    epoch = shown_.epoch;
    // One that fails would fail again, until something else is shown.
    shown_.is_whole = true;
  }
  StoredContents contents(options_.cache_bytes);
  StoredMap map = read_stored_map(options_.store, epoch, &contents, SessionOrder::kArrival);
  // The map's points are in a file: they may be more than fit beside a base.
  merge::MergeResult whole = merge::complete_merge(map.sessions, std::move(map.posed), map.config,
                                                   {}, std::filesystem::temp_directory_path());
  Layers layers = layers_of(map.sessions, whole, map.config.map.voxel_size_m);
  {
    const std::lock_guard lock(mutex_);
    // Something else is shown by now, or sessions that the merge had not: points would have the
    // numbers of others.
    if (shown_.version != version || map.rows != shown_.rows) return false;
    for (std::size_t s = 0; s < shown_.sessions.size(); ++s) {
      if (map.sessions[s].keyframes.size() != shown_.sessions[s].keyframes.size()) continue;
      shown_.merged.sessions[s].refined = std::move(whole.sessions[s].refined);
      shown_.merged.sessions[s].position_sigma_m = std::move(whole.sessions[s].position_sigma_m);
    }
    shown_.merged.changed_objects = std::move(whole.changed_objects);
    shown_.layers = std::move(layers);
    version = ++shown_.version;
    shown_.json.reset();
  }
  events().publish("map", Json{{"epoch", epoch}, {"version", version_of(epoch, version)}}.dump());
  return false;
}

std::string StoreView::described(const Shown& shown) {
  Json json;
  json["format"] = 1;
  json["title"] = options_.store.filename().string();
  json["source"] = options_.held != nullptr ? "base" : "store";
  json["epoch"] = shown.epoch;
  json["version"] = version_of(shown.epoch, shown.version);
  json["can_change"] = options_.may_change && options_.epoch == 0 && shown.version > 0;
  json["notice"] = notice_of(shown.is_read, !shown.sessions.empty());
  json["epochs"] = Json::array();
  json.update(describe_merge(shown.sessions, shown.merged));
  json["layers"] = describe_layers(shown.layers);
  if (shown.is_read) describe_project(shown, json);
  return json_line(json);
}

/// Epochs, and what people said of loops.
void StoreView::describe_project(const Shown& shown, Json& json) {
  store::StoreReader reader(options_.store);
  store::ProjectReader project = reader.project();
  const std::vector<store::Epoch> epochs = project.epochs();
  for (const store::Epoch& epoch : epochs) json["epochs"].push_back(describe(epoch));
  for (const auto& [row, changed] : pose_epochs_.last_changed(project, epochs, shown.epoch)) {
    const auto found = std::find(shown.rows.begin(), shown.rows.end(), row);
    if (found == shown.rows.end()) continue;
    json["sessions"][static_cast<std::size_t>(found - shown.rows.begin())]["epoch"] = changed;
  }
  const KeyframeRows rows(shown.rows, shown.sessions);
  mark_forbidden(shown.statements, rows, shown.merged.loops, json["loops"]);
}

std::shared_ptr<const std::string> StoreView::map_json(std::int64_t epoch) {
  {
    const std::lock_guard lock(mutex_);
    if (epoch == 0 || epoch == shown_.epoch) {
      shown_.is_asked_for = true;
      if (shown_.json == nullptr) {
        shown_.json = std::make_shared<const std::string>(described(shown_));
      }
      return shown_.json;
    }
  }
  return earlier_json(epoch);
}

std::shared_ptr<const std::string> StoreView::earlier_json(std::int64_t epoch) {
  const std::lock_guard one_at_a_time(reading_);
  {
    const std::lock_guard lock(mutex_);
    for (const Shown& shown : earlier_) {
      if (shown.epoch == epoch) return shown.json;
    }
  }
  store::StoreReader reader(options_.store);
  Shown earlier = read(reader.project().at(epoch), false);
  earlier.json = std::make_shared<const std::string>(described(earlier));
  const std::lock_guard lock(mutex_);
  earlier_.push_back(std::move(earlier));
  if (earlier_.size() > kEarlierEpochs) earlier_.pop_front();
  return earlier_.back().json;
}

const StoreView::Shown* StoreView::find(const std::string& version, std::size_t session) const {
  const std::string epoch = version.substr(0, version.find('.'));
  // Keyframes that have arrived since the version was named are still those of their numbers.
  if (epoch == std::to_string(shown_.epoch)) return &shown_;
  const auto found = std::find_if(earlier_.begin(), earlier_.end(), [&](const Shown& shown) {
    return epoch == std::to_string(shown.epoch);
  });
  if (found != earlier_.end()) return &*found;
  // So are those of a session that has kept its number.
  const bool is_kept = std::any_of(before_.begin(), before_.end(), [&](const auto& before) {
    return epoch == std::to_string(before.first) && session < before.second.size() &&
           session < shown_.rows.size() && before.second[session] == shown_.rows[session];
  });
  return is_kept ? &shown_ : nullptr;
}

std::optional<std::string> StoreView::block(const std::string& version, const std::string& layer,
                                            const std::string& key) {
  const std::lock_guard lock(mutex_);
  const bool is_shown = version == version_of(shown_.epoch, shown_.version);
  // A page that still loads the map before is not left without the rest of it.
  if (!is_shown && version != layers_before_.first) return std::nullopt;
  const Layers& layers = is_shown ? shown_.layers : layers_before_.second;
  const auto found = layers.find(layer);
  if (found == layers.end()) return std::nullopt;
  return found->second.blocks.read(key);
}

std::optional<std::string> StoreView::keyframe(const std::string& version, std::size_t session,
                                               std::size_t keyframe) {
  const std::string name = version + "/" + std::to_string(session) + "/" + std::to_string(keyframe);
  KeyframeRecord light;
  std::shared_ptr<const KeyframeContents> contents;
  merge::RefinedKeyframe refined;
  {
    const std::lock_guard lock(mutex_);
    const auto kept = blocks_.find(name);
    if (kept != blocks_.end()) return kept->second;
    const Shown* shown = find(version, session);
    if (shown == nullptr || session >= shown->sessions.size()) return std::nullopt;
    const SessionData& data = shown->sessions[session];
    if (keyframe >= data.keyframes.size() || data.keyframes[keyframe].is_summary) {
      return std::nullopt;
    }
    light = data.keyframes[keyframe];
    contents = data.contents;
    const auto& labels = shown->merged.sessions[session].refined;
    if (keyframe < labels.size()) refined = labels[keyframe];
  }
  std::string block = keyframe_block(*contents->whole(light), &refined, session_byte(session));
  keep_block(name, block);
  return block;
}

/// The blocks that were made last are kept: all who look ask for the same ones.
void StoreView::keep_block(const std::string& name, const std::string& block) {
  const std::lock_guard lock(mutex_);
  if (!blocks_.emplace(name, block).second) return;
  block_bytes_ += block.size();
  oldest_blocks_.push_back(name);
  while (block_bytes_ > options_.cache_bytes) {
    const auto oldest = blocks_.find(oldest_blocks_.front());
    block_bytes_ -= oldest->second.size();
    blocks_.erase(oldest);
    oldest_blocks_.pop_front();
  }
}

std::string StoreView::health_json() {
  Json robots = Json::array();
  Json alarms = Json::array();
  std::vector<store::HealthRow> history;
  if (store::has_tables(options_.store)) history = store::read_health(options_.store);
  const std::lock_guard lock(mutex_);
  for (std::size_t s = 0; s < shown_.rows.size(); ++s) {
    Json robot = describe_health(history, shown_.rows[s]);
    if (robot.is_null()) continue;
    robot["session"] = s;
    robot["name"] = shown_.sessions[s].info.name;
    robots.push_back(std::move(robot));
  }
  for (const RobotAlarm& alarm : robots_.alarms()) {
    alarms.push_back(describe_alarm(alarm));
    alarms.back()["session"] = index_or_null(index_of(alarm.session));
  }
  return json_line({{"robots", robots}, {"alarms", alarms}});
}

}  // namespace unimapper::apps
