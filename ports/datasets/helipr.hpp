// Parser of HeLiPR's binary scans.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// The four LiDARs of HeLiPR.
enum class HeliprSensor : std::uint8_t { kAeva, kAvia, kOuster, kVelodyne };

/// Directory name of a sensor, e.g. "Ouster".
std::string_view helipr_directory(HeliprSensor sensor);

/// Finds a sensor by its directory name or by any name `find_sensor` knows its model by.
std::optional<HeliprSensor> find_helipr_sensor(std::string_view name);

/// Decodes packed little-endian records without a header: Ouster 26, Velodyne 22, Avia 19, Aeva
/// 25 or (recorded after 1691936557946849179 ns) 29 bytes. Aeva's record size follows from
/// `stamp_ns` where the bytes allow it, else from which of the two divides them. Throws
/// DatasetError if a partial record remains.
void parse_helipr(std::string_view bytes, HeliprSensor sensor, std::int64_t stamp_ns,
                  const std::filesystem::path& file, Scan& scan);

}  // namespace unimapper::datasets
