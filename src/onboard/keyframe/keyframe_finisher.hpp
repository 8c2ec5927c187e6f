// Final labels, description and loop search of a closed keyframe, at once or in slices
#pragma once

#include <cstdint>

#include "cell_table.hpp"
#include "keyframe.hpp"
#include "src/onboard/removal/evidence_window.hpp"
#include "src/onboard/removal/final_labels.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/place/database.hpp"
#include "unimapper/place/describer.hpp"

namespace unimapper::onboard {

/// Does for a closed keyframe what need not be known at once: the final labels of the keyframe that
/// it evicts from the window, the description of its place, loop search and insertion. Either
/// within the call that closes it (`finish_now`), or in slices (`step`), with the same results.
class KeyframeFinisher {
 public:
  explicit KeyframeFinisher(const PipelineConfig& config) noexcept : config_(config) {}
  void allocate(Arena& arena) noexcept;
  /// After that: what is in use only from `begin` to the last step.
  void allocate_scratch(Arena& arena) noexcept {
    describer_.allocate_scratch(arena, config_.descriptor, config_.descriptor_input());
    if (!config_.deferred) places_.allocate_scratch(arena, config_.loop_search);
  }

  /// The odometry was restarted. The window forgets first.
  void forget() noexcept { labels_.forget(); }

  /// Begins to relabel the keyframe that the next record evicts. What was begun before is finished,
  /// and with `keeps_result` its final labels can be applied until the first `step`. O(1); without
  /// `deferred` O(undecided cells x images of the window).
  void begin_labels(const EvidenceWindow& window, bool keeps_result) noexcept;
  /// Then stores what final labels will need of the decided cells of `keyframe`, before the window
  /// records them. O(blocks).
  void store_labels(const EvidenceWindow& window, const CellTable& cells,
                    Keyframe& keyframe) noexcept;
  /// The keyframe is complete but for its place, and recorded: the rest may be done.
  void begin(Keyframe& keyframe) noexcept;

  /// Describes, searches and inserts.
  void finish_now() noexcept;

  /// A slice: one step of the work in progress. False once the keyframe is finished. Bounded as
  /// `FinalLabels::step`, `PlaceDescriber::step` and `PlaceDatabase::search_step` are, or one
  /// insertion.
  bool step(const EvidenceWindow& window) noexcept;
  /// What the next slice costs, about (`slice_cost`), and all that are left; 0 just if none is.
  [[nodiscard]] std::uint32_t step_cost() const noexcept;
  [[nodiscard]] std::uint32_t cost_left() const noexcept;
  /// What all slices of the last keyframe cost, about, done or not.
  [[nodiscard]] std::uint32_t whole_cost() const noexcept { return cost_ + cost_left(); }
  /// A keyframe is not finished yet.
  [[nodiscard]] bool is_busy() const noexcept { return task_ != Task::kDone; }

  [[nodiscard]] FinalLabels& labels() noexcept { return labels_; }
  [[nodiscard]] const FinalLabels& labels() const noexcept { return labels_; }
  [[nodiscard]] PlaceDatabase& places() noexcept { return places_; }

 private:
  enum class Task : std::uint8_t { kLabels, kDescription, kSearch, kInsertion, kDone };

  [[nodiscard]] static Stage stage_of(Task task) noexcept;
  [[nodiscard]] KeyframeId id() const noexcept { return {0, keyframe_->view.sequence}; }
  void take_labels() noexcept;
  void take_place() noexcept;
  void begin_search() noexcept;
  void insert() noexcept;
  void count_places() noexcept;
  void describe_now() noexcept;
  void search_now() noexcept;

  const PipelineConfig& config_;
  FinalLabels labels_;
  PlaceDescriber describer_;
  PlaceDatabase places_;
  Task task_ = Task::kDone;
  Keyframe* keyframe_ = nullptr;           ///< that is being finished, or the last one
  std::uint64_t dropped_before_ = 0;       ///< by the database
  std::uint32_t cost_ = 0;                 ///< of the slices done for it
  std::uint32_t search_steps_ = 0;         ///< of the search in progress, or the last one
  std::uint32_t search_steps_before_ = 0;  ///< of the search before
};

}  // namespace unimapper::onboard
