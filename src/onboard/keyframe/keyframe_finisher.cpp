#include "keyframe_finisher.hpp"

#include <algorithm>
#include <utility>

#include "src/onboard/slice_cost.hpp"
#include "src/onboard/stage_clock.hpp"

namespace unimapper::onboard {

void KeyframeFinisher::allocate(Arena& arena) noexcept {
  labels_.allocate(arena, config_);
  describer_.allocate_kept(arena, config_.descriptor, config_.descriptor_input());
  places_.allocate_kept(arena, config_.loop_search, config_.place_shape());
  // Others may search while the table of a keyframe is in use.
  if (config_.deferred) places_.allocate_scratch(arena, config_.loop_search);
}

void KeyframeFinisher::begin_labels(const EvidenceWindow& window, bool keeps_result) noexcept {
  labels_.begin_evicted(window, keeps_result);
  if (!config_.deferred) labels_.finish(window);
}

void KeyframeFinisher::store_labels(const EvidenceWindow& window, const CellTable& cells,
                                    Keyframe& keyframe) noexcept {
  labels_.store(window, cells, keyframe.view.sequence);
  keyframe.dropped(DropCause::kEvidenceFull) = window.left_out() + labels_.not_stored();
}

void KeyframeFinisher::begin(Keyframe& keyframe) noexcept {
  keyframe_ = &keyframe;
  cost_ = 0;
  dropped_before_ = places_.dropped();
  describer_.begin(keyframe.view.static_cells);
  task_ = Task::kLabels;
  if (labels_.steps_left() == 0) take_labels();
}

bool KeyframeFinisher::step(const EvidenceWindow& window) noexcept {
  if (!is_busy()) return false;
  cost_ += step_cost();
  const StageTimer total(config_.clock_ns, keyframe_->statistics, Stage::kTotal);
  const StageTimer time(config_.clock_ns, keyframe_->statistics, stage_of(task_));
  switch (task_) {
    case Task::kLabels:
      if (!labels_.step(window)) take_labels();
      break;
    case Task::kDescription:
      if (describer_.step()) break;
      take_place();
      begin_search();
      break;
    case Task::kSearch:
      ++search_steps_;
      if (places_.search_step()) break;
      keyframe_->view.loops = places_.found();
      task_ = Task::kInsertion;
      break;
    case Task::kInsertion:
      insert();
      task_ = Task::kDone;
      break;
    case Task::kDone:
      break;
  }
  return is_busy();
}

std::uint32_t KeyframeFinisher::step_cost() const noexcept {
  switch (task_) {
    case Task::kLabels:
      return slice_cost::kLabels;
    case Task::kDescription:
      return slice_cost::kDescription;
    case Task::kSearch:
      return slice_cost::kSearch;
    case Task::kInsertion:
      return slice_cost::kInsertion;
    case Task::kDone:
      break;
  }
  return 0;
}

std::uint32_t KeyframeFinisher::cost_left() const noexcept {
  if (!is_busy()) return 0;
  std::uint32_t searches = 0;
  // How long a search takes is known only when it is over: about as long as the last one.
  constexpr std::uint32_t kMore = 2;
  if (task_ < Task::kSearch) searches += search_steps_ + kMore;
  if (task_ == Task::kSearch) {
    searches += search_steps_before_ + kMore - std::min(search_steps_, search_steps_before_);
  }
  return slice_cost::kLabels * labels_.steps_left() +
         slice_cost::kDescription * describer_.steps_left() + slice_cost::kSearch * searches +
         slice_cost::kInsertion;
}

Stage KeyframeFinisher::stage_of(Task task) noexcept {
  switch (task) {
    case Task::kLabels:
      return Stage::kRemoval;
    case Task::kDescription:
      return Stage::kDescription;
    default:
      return Stage::kSearch;
  }
}

void KeyframeFinisher::take_labels() noexcept {
  if (labels_.is_done()) {
    keyframe_->view.relabelled = labels_.result();
    keyframe_->dropped(DropCause::kEvidenceFull) += labels_.not_relabelled();
  }
  task_ = Task::kDescription;
}

void KeyframeFinisher::take_place() noexcept {
  keyframe_->view.place = describer_.place();
  keyframe_->view.place.up = keyframe_->view.up;
  keyframe_->dropped(DropCause::kDescriptionFull) = describer_.dropped();
}

void KeyframeFinisher::begin_search() noexcept {
  places_.begin_search(keyframe_->view.place, id(), config_.search_scope);
  search_steps_before_ = std::exchange(search_steps_, 0);
  task_ = Task::kSearch;
}

void KeyframeFinisher::insert() noexcept {
  places_.insert(keyframe_->view.place, id(), keyframe_->view.T_odometry_keyframe);
  count_places();
}

void KeyframeFinisher::count_places() noexcept {
  keyframe_->dropped(DropCause::kTriangleTableFull) = places_.dropped() - dropped_before_;
  keyframe_->use(Capacity::kPlaces, places_.size(), config_.loop_search.max_places);
}

void KeyframeFinisher::finish_now() noexcept {
  describe_now();
  search_now();
  task_ = Task::kDone;
}

void KeyframeFinisher::describe_now() noexcept {
  const StageTimer timer(config_.clock_ns, keyframe_->statistics, Stage::kDescription);
  while (describer_.step()) {
  }
  take_place();
}

void KeyframeFinisher::search_now() noexcept {
  const StageTimer timer(config_.clock_ns, keyframe_->statistics, Stage::kSearch);
  keyframe_->view.loops = places_.search(keyframe_->view.place, id(), config_.search_scope);
  insert();
}

}  // namespace unimapper::onboard
