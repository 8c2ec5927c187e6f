// The map of a store, as it is and while it grows.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ports/store/project_writer.hpp"
#include "ports/store/session_follower.hpp"
#include "ports/store/store_file.hpp"
#include "src/apps/base/repeated_work.hpp"
#include "src/apps/map/held_sessions.hpp"
#include "src/apps/merge/stored_contents.hpp"
#include "src/apps/view/map_view.hpp"
#include "src/apps/view/pose_epochs.hpp"
#include "src/apps/view/robot_watch.hpp"
#include "src/apps/view/view_source.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {

/// Which map of a store is shown.
struct StoreViewOptions {
  std::filesystem::path store;
  std::int64_t epoch = 0;   ///< number of the epoch shown, as it is; 0: the latest, as it grows
  bool may_change = false;  ///< who knows the token may
  std::uint64_t cache_bytes = 500'000'000;  ///< of keyframes, and as much again of their points
  const store::StoreLock* held = nullptr;   ///< of the process that holds the store; null: none
  std::function<void(const std::string&)> report;  ///< told in words, from threads of its own
};

/// Shows the sessions of a store: first poses, loops and keyframes; once nothing has changed for
/// some seconds and somebody looks, the whole map. Sessions have the order in which they came.
/// Looks for changes by other threads and processes five times a second; a store that is not there
/// yet is shown as soon as a base has made it.
class StoreView : public ViewSource {
 public:
  /// Reads the store, if it is there. Throws std::exception, in words, if it cannot be read, or has
  /// no such epoch.
  explicit StoreView(StoreViewOptions options);
  ~StoreView() override;

  [[nodiscard]] std::shared_ptr<const std::string> map_json(std::int64_t epoch) override;
  [[nodiscard]] std::optional<std::string> block(const std::string& version,
                                                 const std::string& layer,
                                                 const std::string& key) override;
  [[nodiscard]] std::optional<std::string> keyframe(const std::string& version, std::size_t session,
                                                    std::size_t keyframe) override;
  [[nodiscard]] std::string health_json() override;
  [[nodiscard]] ViewAnswer decide(const NamedLoop& loop, LoopStatement statement,
                                  std::int64_t epoch) override;
  [[nodiscard]] ViewAnswer undo(std::int64_t epoch) override;

 private:
  using Clock = std::chrono::steady_clock;

  /// What is shown; what is replaced as a whole is not changed any more.
  struct Shown {
    std::int64_t epoch = 0;
    std::int64_t result = 0;
    std::vector<std::int64_t> rows;                  ///< of the sessions
    std::vector<SessionData> sessions;               ///< without cells; live ones grow
    merge::MergeResult merged;                       ///< merge of the sessions
    std::vector<store::StoredStatement> statements;  ///< of people
    Layers layers;                                   ///< none until the map is whole
    std::uint64_t version = 0;                       ///< of everything above
    bool is_read = false;                            ///< from a store; false: there is none yet
    bool is_asked_for = false;                       ///< somebody looks at it
    bool is_whole = false;
    std::shared_ptr<const std::string> json;  ///< the map as it is sent, once it was asked for
  };

  bool look();
  bool watch();
  [[nodiscard]] std::optional<std::size_t> index_of(std::int64_t row) const;
  [[nodiscard]] bool follows();
  void load(const store::ProjectState& state);
  void take_new_keyframes();
  void take(std::int64_t row, const store::StoredKeyframe& stored);
  bool complete();
  [[nodiscard]] store::ProjectState state_to_show();
  void read_sessions_of(const store::ProjectState& state, const store::MapResult& stored,
                        Shown& shown);
  [[nodiscard]] Shown read(const store::ProjectState& state, bool is_latest);
  /// One with the keyframes of a session as that version numbers them; null: there is none. Under
  /// `mutex_`.
  [[nodiscard]] const Shown* find(const std::string& version, std::size_t session) const;
  [[nodiscard]] std::optional<StatedLoop> find(const NamedLoop& named) const;
  [[nodiscard]] std::shared_ptr<const std::string> earlier_json(std::int64_t epoch);
  [[nodiscard]] std::string described(const Shown& shown);
  void describe_project(const Shown& shown, nlohmann::ordered_json& json);
  void keep_block(const std::string& name, const std::string& block);
  [[nodiscard]] ViewAnswer change(std::int64_t epoch,
                                  const std::function<store::Epoch(store::ProjectWriter&)>& make);

  StoreViewOptions options_;
  StoredContents contents_;  ///< of earlier epochs
  PoseEpochs pose_epochs_;

  // Of the thread that looks.
  std::optional<HeldSessions> sessions_;
  std::optional<store::SessionFollower> follower_;  ///< none until the store is there
  std::map<std::int64_t, std::int64_t> newest_;     ///< by row: sequence that was taken last

  std::mutex mutex_;  ///< of all that follows
  Shown shown_;
  std::deque<std::pair<std::int64_t, std::vector<std::int64_t>>>
      before_;                                    ///< epochs and their rows
  std::pair<std::string, Layers> layers_before_;  ///< of the whole map before this one, its version
  std::deque<Shown> earlier_;                     ///< epochs that were asked for last
  std::map<std::string, std::string> blocks_;     ///< of keyframes, by version and number
  std::deque<std::string> oldest_blocks_;
  std::uint64_t block_bytes_ = 0;
  Clock::time_point changed_{};

  std::mutex changing_;  ///< one change at a time
  std::mutex reading_;   ///< one earlier epoch at a time
  RobotWatch robots_;
  std::optional<RepeatedWork> looking_;
  std::optional<RepeatedWork> watching_;
  std::optional<RepeatedWork> completing_;
};

}  // namespace unimapper::apps
