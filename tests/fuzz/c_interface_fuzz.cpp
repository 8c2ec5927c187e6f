// Fuzz target of the C interface: any configuration is accepted or refused in words, any points,
// poses and stamps are taken or refused, and every keyframe that comes out is one for the base.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "ports/c/unimapper.h"
#include "tests/fuzz/fuzz.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/wire/keyframe_codec.hpp"

namespace {

using namespace unimapper;
using fuzz::require;

/// The input, a value at a time; zeros after its end.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

  template <typename T>
  T get() {
    T value{};
    fill(&value, sizeof value);
    return value;
  }
  void fill(void* to, std::size_t bytes) {
    const std::size_t count = std::min(bytes, left_);
    if (count > 0) std::memcpy(to, data_, count);
    data_ += count;
    left_ -= count;
  }
  [[nodiscard]] bool is_empty() const { return left_ == 0; }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

/// A configuration of anything, which must be consistent about what it refuses.
void configure(Input& input) {
  um_config config;
  const char* message = nullptr;
  if (input.get<std::uint8_t>() % 2 == 0) {
    um_sensor_model model;
    input.fill(&model, sizeof model);
    const um_status made =
        um_config_from_model(&config, &model, input.get<std::uint32_t>() % 5, &message);
    if (made != UM_OK) {
      require(message != nullptr && *message != '\0');
      return;
    }
  } else {
    const auto sensor = static_cast<std::uint32_t>(input.get<std::uint8_t>() % 10);
    const auto computer = static_cast<std::uint32_t>(input.get<std::uint8_t>() % 5);
    if (um_config_init_for(&config, sensor, computer) != UM_OK) return;
  }
  const auto table = kParameters<PipelineConfig>;
  for (int i = 0; i < 8 && !input.is_empty(); ++i) {
    const std::string name(table[input.get<std::uint16_t>() % table.size()].name.view());
    char value[24] = {};
    input.fill(value, sizeof value - 1);
    if (um_config_set(&config, name.c_str(), value, &message) != UM_OK) continue;
    char again[64] = {};
    require(um_config_get(&config, name.c_str(), again, sizeof again) == UM_OK);
    require(um_config_set(&config, name.c_str(), again, nullptr) == UM_OK);
  }
  const bool is_valid = um_config_check(&config, &message) == UM_OK;
  require(is_valid == (um_required_bytes(&config) > 0));
  require(is_valid || (message != nullptr && *message != '\0'));
}

um_config small_config() {
  um_config config;
  require(um_config_init(&config, UM_SENSOR_VLP_16) == UM_OK);
  config.keyframe_scans = 2;
  config.keyframe_max_points_per_scan = 256;
  config.voxel_max_cells = 4096;
  config.loop_search_max_places = 4;
  return config;
}

/// A pipeline in a block of its own, and memory for its keyframes' bytes.
struct Pipeline {
  um_config config = small_config();
  MemoryBlock block{um_required_bytes(&config)};
  um_pipeline* handle = nullptr;
  MemoryBlock scratch{1};
  std::vector<std::uint8_t> bytes = std::vector<std::uint8_t>(1U << 20U);

  Pipeline() {
    require(um_init(&config, block.data(), block.size(), &handle, nullptr) == UM_OK);
    scratch = MemoryBlock(um_encode_scratch_bytes(handle));
  }
};

void check_keyframe(Pipeline& pipeline) {
  const um_session session{7, 0, 1, 2};
  um_encoded encoded;
  const um_status status = um_keyframe_encode(pipeline.handle, &session, pipeline.scratch.data(),
                                              pipeline.scratch.size(), pipeline.bytes.data(),
                                              pipeline.bytes.size(), &encoded);
  require(status == UM_OK);
  const auto decoded = wire::decode_keyframe({pipeline.bytes.data(), encoded.bytes});
  require(decoded.record.has_value());
}

um_points points_of(Input& input, std::vector<std::uint8_t>& data) {
  data.resize(4096);
  input.fill(data.data(), input.get<std::uint16_t>() % data.size());
  um_points points{};
  points.data = data.data();
  points.stride = input.get<std::uint8_t>();
  points.offset_x = input.get<std::uint8_t>();
  points.offset_y = input.get<std::uint8_t>();
  points.offset_z = input.get<std::uint8_t>();
  // Whoever hands in fewer bytes than he says cannot be found out.
  const std::size_t last = std::max({points.offset_x, points.offset_y, points.offset_z}) + 4;
  points.count = points.stride == 0 ? 1 : (data.size() - last) / points.stride + 1;
  return points;
}

void add_scans(Input& input) {
  static Pipeline pipeline;
  require(um_reset(pipeline.handle) == UM_OK);
  std::vector<std::uint8_t> data;
  for (int i = 0; i < 16 && !input.is_empty(); ++i) {
    const um_points points = points_of(input, data);
    um_pose pose{{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    if (input.get<std::uint8_t>() % 4 == 0) input.fill(&pose, sizeof pose);
    const auto stamp_ns = input.get<std::uint8_t>() % 4 == 0 ? input.get<std::int64_t>()
                                                             : std::int64_t{100000000} * i;
    std::int32_t ready = 0;
    const std::size_t stride = input.get<std::uint8_t>() % 5;
    const std::vector<std::uint8_t> intensities((points.count - 1) * stride + 1, 7);
    const um_status status = um_add_scan_with_intensities(
        pipeline.handle, &points, stride == 4 ? nullptr : intensities.data(), stride, &pose,
        stamp_ns, &ready);
    require(status == UM_OK || *um_message(pipeline.handle) != '\0');
    if (ready != 0) check_keyframe(pipeline);
  }
  std::int32_t ready = 0;
  require(um_flush(pipeline.handle, &ready) == UM_OK);
  if (ready != 0) check_keyframe(pipeline);
  um_health health;
  require(um_health_get(pipeline.handle, &health) == UM_OK);
  require(health.scans_refused <= health.scans && health.points_dynamic <= health.points_in);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Input input(data, size);
  input.get<std::uint8_t>() % 2 == 0 ? configure(input) : add_scans(input);
  return 0;
}
