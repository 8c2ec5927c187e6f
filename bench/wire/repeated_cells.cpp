// Share of a keyframe's static cells that earlier keyframes had: what differencing could leave out.
//   repeated_cells LOG...   event logs of runs (keyframes.lcmlog)
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <unordered_set>
#include <vector>

#include "ports/lcm/received_log.hpp"
#include "unimapper/core/voxel_key.hpp"

namespace {

using namespace unimapper;
using Cells = std::unordered_set<std::uint64_t>;

constexpr std::size_t kEarlier = 5;

/// In the grid of the odometry, which all keyframes of a session share.
Cells cells_of(const KeyframeRecord& keyframe) {
  Cells cells;
  for (const FineCell& cell : keyframe.static_cells) {
    const Eigen::Vector3d p = keyframe.T_odometry_keyframe * cell.position.cast<double>();
    cells.insert(pack(voxel_index(p.cast<float>(), 1.0F / keyframe.cell_size_m)));
  }
  return cells;
}

double share_in(const Cells& cells, const std::vector<Cells>& earlier, std::size_t first) {
  std::size_t count = 0;
  for (const std::uint64_t cell : cells) {
    for (std::size_t k = first; k < earlier.size(); ++k) {
      if (!earlier[k].contains(cell)) continue;
      ++count;
      break;
    }
  }
  return cells.empty() ? 0.0 : static_cast<double>(count) / static_cast<double>(cells.size());
}

/// Bits that tell, for one cell, whether it is among so large a share.
double entropy(double share) {
  if (share <= 0.0 || share >= 1.0) return 0.0;
  return -share * std::log2(share) - (1.0 - share) * std::log2(1.0 - share);
}

void print(const char* log) {
  const lcm_port::ReceivedLog received = lcm_port::read_event_log(log);
  std::vector<Cells> earlier;
  double last = 0.0;
  double any = 0.0;
  double bits = 0.0;
  int keyframes = 0;
  for (const SessionData& session : received.sessions) {
    earlier.clear();
    for (const KeyframeRecord& keyframe : session.keyframes) {
      Cells cells = cells_of(keyframe);
      if (earlier.size() == kEarlier) {
        ++keyframes;
        last += share_in(cells, earlier, kEarlier - 1);
        any += share_in(cells, earlier, 0);
        bits += entropy(share_in(earlier.back(), {cells}, 0));
        earlier.erase(earlier.begin());
      }
      earlier.push_back(std::move(cells));
    }
  }
  const double n = std::max(1, keyframes);
  std::printf(
      "%s: %d keyframes; cells that the one before had %.2f, any of the %zu before %.2f; bits a "
      "cell to say which %.2f\n",
      log, keyframes, last / n, kEarlier, any / n, bits / n);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    for (int i = 1; i < argc; ++i) print(argv[i]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "repeated_cells: %s\n", error.what());
    return 1;
  }
  return 0;
}
