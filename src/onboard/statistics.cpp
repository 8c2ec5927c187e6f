#include "unimapper/onboard/statistics.hpp"

namespace unimapper {

std::string_view drop_cause_name(DropCause cause) noexcept {
  switch (cause) {
    case DropCause::kNotFinite:
      return "not_finite";
    case DropCause::kOutOfRange:
      return "out_of_range";
    case DropCause::kScanTooLarge:
      return "scan_too_large";
    case DropCause::kCellsFull:
      return "cells_full";
    case DropCause::kVoxelsFull:
      return "voxels_full";
    case DropCause::kEvidenceFull:
      return "evidence_full";
    case DropCause::kDescriptionFull:
      return "description_full";
    case DropCause::kTriangleTableFull:
      return "triangle_table_full";
  }
  return "unknown";
}

std::string_view stage_name(Stage stage) noexcept {
  switch (stage) {
    case Stage::kIngest:
      return "ingest";
    case Stage::kRemoval:
      return "removal";
    case Stage::kDescription:
      return "description";
    case Stage::kSearch:
      return "search";
    case Stage::kTotal:
      return "total";
  }
  return "unknown";
}

std::string_view capacity_name(Capacity capacity) noexcept {
  switch (capacity) {
    case Capacity::kPointsPerScan:
      return "points_per_scan";
    case Capacity::kCells:
      return "cells";
    case Capacity::kVoxels:
      return "voxels";
    case Capacity::kBlocks:
      return "blocks";
    case Capacity::kPlaces:
      return "places";
  }
  return "unknown";
}

}  // namespace unimapper
