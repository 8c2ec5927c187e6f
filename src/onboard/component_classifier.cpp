#include "component_classifier.hpp"

#include <algorithm>
#include <bit>

#include "unimapper/free_space/evidence_weights.hpp"

namespace unimapper::onboard {

void ComponentClassifier::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  config_ = config.removal;
  confirmed_static_ = in_thousandths(std::min(config.removal.confirmed_static_log_odds, 30.0F));
  const std::size_t max_parts = config.voxel.max_blocks() * 2;
  labels_.allocate(arena, config.voxel.max_blocks(), max_parts, config.voxel.max_cells);
  tally_ = arena.allocate<Tally>(max_parts);
}

std::uint32_t ComponentClassifier::run(const BlockWindow& window,
                                       std::span<const std::int16_t> log_odds,
                                       CellTable& cells) noexcept {
  const std::uint32_t components = labels_.label(
      cells.blocks(),
      [&](std::uint32_t b) noexcept {
        const std::uint64_t following = followers(window, cells, b);
        return LabelledCells{cells.marks(b).candidate & ~following, following};
      },
      [&](std::uint32_t b, const BlockOffset& offset) noexcept {
        return window.neighbour(b, offset);
      });
  count(window, log_odds, cells);
  classify_all(window, cells);
  return components;
}

void ComponentClassifier::count(const BlockWindow& window, std::span<const std::int16_t> log_odds,
                                const CellTable& cells) noexcept {
  std::fill_n(tally_, labels_.size(), Tally{});
  const std::span<const Block> blocks = cells.blocks();
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    if (cells.marks(b).candidate == 0) continue;
    const BlockHistory before = window.before(b);
    labels_.visit(b, blocks[b], followers(window, cells, b),
                  [&](std::uint32_t component, std::uint64_t some) noexcept {
                    count_cells(tally_[component], some, blocks[b], log_odds, before);
                  });
  }
}

void ComponentClassifier::count_cells(Tally& tally, std::uint64_t cells, const Block& block,
                                      std::span<const std::int16_t> log_odds,
                                      const BlockHistory& before) const noexcept {
  tally.cells += popcount(cells);
  for (std::uint64_t left = cells; left != 0; left &= left - 1) {
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
    const std::int32_t sum = std::clamp<std::int32_t>(log_odds[row_of(block, bit)],
                                                      -confirmed_static_, confirmed_static_);
    tally.evidence += static_cast<std::uint32_t>(sum < 0 ? -sum : sum);
    tally.evidence_dynamic += static_cast<std::uint32_t>(sum < 0 ? 0 : sum);
  }
  tally.was_dynamic += popcount(cells & before.proven);
  tally.was_static += popcount(cells & before.occupied & ~before.dynamic);
}

bool ComponentClassifier::persists(const Tally& tally) const noexcept {
  return config_.persistence_share > 0.0F && tally.was_dynamic > 0 &&
         static_cast<float>(tally.was_dynamic) >=
             config_.persistence_share * static_cast<float>(tally.cells) &&
         tally.was_dynamic >= 2 * tally.was_static;
}

void ComponentClassifier::classify_all(const BlockWindow& window, CellTable& cells) const noexcept {
  const std::span<const Block> blocks = cells.blocks();
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    CellMarks& marks = cells.marks(b);
    labels_.visit(b, blocks[b], followers(window, cells, b),
                  [&](std::uint32_t component, std::uint64_t some) noexcept {
                    mark(some, tally_[component], marks);
                  });
  }
}

void ComponentClassifier::mark(std::uint64_t cells, const Tally& tally,
                               CellMarks& marks) const noexcept {
  if (persists(tally)) {
    marks.dynamic |= cells;
    marks.proven |= cells;
    return;
  }
  switch (classify(tally.evidence_dynamic, tally.evidence, config_.component_dynamic_share,
                   config_.component_static_share)) {
    case ComponentClass::kDynamic:
      marks.dynamic |= cells & ~(marks.confirmed_static & ~marks.low);
      break;
    case ComponentClass::kStatic:
      marks.dynamic &= ~(cells & ~marks.confirmed_dynamic);
      break;
    case ComponentClass::kMixed:
      break;
  }
}

}  // namespace unimapper::onboard
