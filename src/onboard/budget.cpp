#include "budget.hpp"

#include <algorithm>

namespace unimapper::onboard {
namespace {

constexpr float kReserve = 1.25F;

}  // namespace

std::uint32_t Budget::affordable_cells() const noexcept {
  constexpr std::uint32_t kAll = 0xFFFFFFFFU;
  const float per_cell_us = expected_us(Part::kFiltering);
  if (!is_on() || per_cell_us <= 0.0F) return kAll;
  const float left_us =
      budget_us_ - spent_us() - expected_us(Part::kClassifying) - expected_us(Part::kCounting);
  const float cells = std::max(left_us, 0.0F) / per_cell_us;
  return cells < 1e9F ? static_cast<std::uint32_t>(cells) : kAll;
}

bool Budget::affords(std::uint32_t slice_cost) const noexcept {
  return !is_on() ||
         spent_us() + kReserve * slice_us_ * static_cast<float>(slice_cost) <= budget_us_;
}

bool Budget::affords(Part part) noexcept {
  if (!is_on()) return true;
  float needed_us = expected_us(part) + expected_us(Part::kCounting);
  // Loop search is skipped before the place is not stored.
  if (part == Part::kSearching) needed_us += expected_us(Part::kInserting);
  if (spent_us() + needed_us <= budget_us_) return true;
  lately_us(part) *= kFading;
  return false;
}

void Budget::note(Part part, std::uint32_t units, float cost_us) noexcept {
  float& lately = lately_us(part);
  lately *= kFading;
  if (units > 0) lately = std::max(lately, cost_us / static_cast<float>(units));
}

float Budget::expected_us(Part part) const noexcept {
  return kReserve * lately_us_[static_cast<std::size_t>(part)];
}

}  // namespace unimapper::onboard
