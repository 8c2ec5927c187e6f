#include "ports/datasets/readers.hpp"

#include <algorithm>
#include <array>
#include <system_error>

#include "ports/datasets/files.hpp"
#include "ports/datasets/formats.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace {

constexpr std::array<Reader, 8> kReaders = {{
    {"kitti",
     "scans/ or velodyne/ with *.bin and poses.txt, or a root with sequences/ and --sequence",
     &recognises_kitti, &open_kitti},
    {"helipr", "LiDAR/SENSOR/ with *.bin, LiDAR_GT/SENSOR_gt.txt", &recognises_helipr,
     &open_helipr},
    {"kitti-raw", "velodyne_points/ and oxts/, or a date's folder and --sequence",
     &recognises_kitti_raw, &open_kitti_raw},
    {"nuscenes", "v1.0-*/ with tables, samples/ and sweeps/; --sequence names the scene",
     &recognises_nuscenes, &open_nuscenes},
    {"dynamicmap", "pcd/ with *.pcd in the world frame, the sensor's pose in VIEWPOINT",
     &recognises_dynamic_map, &open_dynamic_map},
    {"pcd", "Scans/ or pcd/ with *.pcd, poses.txt in TUM or KITTI form", &recognises_pcd,
     &open_pcd},
    {"bag", "*.mcap, *.db3 or *.bag with scans and odometry or transforms, or a folder with one",
     &recognises_bag, &open_bag},
    {"folder", "scans *.ply, *.pcd, *.bin, *.xyz, *.csv in it or in scans/, and a pose file",
     &recognises_folder, &open_folder},
}};

}  // namespace

std::span<const Reader> readers() { return kReaders; }

const Reader* find_reader(std::string_view name) {
  const auto found = std::find_if(kReaders.begin(), kReaders.end(),
                                  [&](const Reader& reader) { return reader.name == name; });
  return found == kReaders.end() ? nullptr : &*found;
}

namespace {

/// Files that are not read as they are, and what makes them so.
struct OtherFile {
  std::string_view extension;
  std::string_view remedy;
};

constexpr std::array<OtherFile, 17> kOtherFiles = {{
    {".gz", "compressed: unpack with `gunzip`"},
    {".bz2", "compressed: unpack with `bunzip2`"},
    {".xz", "compressed: unpack with `unxz`"},
    {".zst", "compressed: unpack with `unzstd`"},
    {".lz4", "compressed: unpack with `unlz4`"},
    {".lz", "compressed: unpack with `lzip -d`"},
    {".zip", "compressed: unpack with `unzip`"},
    {".7z", "compressed: unpack with `7z x`"},
    {".tar", "an archive: unpack with `tar xf`"},
    {".tgz", "compressed: unpack with `tar xf`"},
    {".rar", "compressed: unpack with `unrar x`"},
    {".las", "LAS, which is not read: convert to PLY, e.g. with CloudCompare"},
    {".laz", "LAZ, which is not read: convert to PLY, e.g. with CloudCompare"},
    {".e57", "E57, which is not read: convert to PLY, e.g. with CloudCompare"},
    {".npy", "NumPy, which is not read: write x y z intensity as float32 with tofile() to *.bin"},
    {".npz", "NumPy, which is not read: write x y z intensity as float32 with tofile() to *.bin"},
    {".pcap", "packets of a sensor, which are not read: convert to PCD with its maker's tool"},
}};

void refuse_other_file(const fs::path& file) {
  const std::string extension = lower_case(file.extension().string());
  for (const OtherFile& other : kOtherFiles) {
    if (other.extension == extension) {
      fail(file, std::string(other.remedy) + ", then give the folder of the scans");
    }
  }
}

/// Names what is there where nothing can be read: files of other kinds, or one scan.
void refuse_other_files(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    refuse_other_file(path);
    for (const std::string_view scan : {".pcd", ".ply", ".bin", ".xyz"}) {
      if (lower_case(path.extension().string()) == scan) {
        fail(path, "is one scan; give the folder of the recording");
      }
    }
    return;
  }
  std::vector<fs::path> folders = list_directories(path);
  folders.insert(folders.begin(), path);
  for (const fs::path& folder : folders) {
    for (const OtherFile& other : kOtherFiles) {
      for (const fs::path& file : list_files(folder, other.extension)) refuse_other_file(file);
    }
  }
}

}  // namespace

const Reader& recognise(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) fail(path, "no such file or directory");
  for (const Reader& reader : kReaders) {
    if (reader.recognises(path)) return reader;
  }
  refuse_other_files(path);
  std::string expected;
  for (const Reader& reader : kReaders) {
    expected += (expected.empty() ? "" : "; ") + std::string(reader.name) + ": " +
                std::string(reader.description);
  }
  fail(path, "not a recording of a known format. Expected is one of " + expected +
                 "; docs/datasets.md shows every layout");
}

std::string format_names() {
  std::string names = "auto";
  for (const Reader& reader : kReaders) names += ", " + std::string(reader.name);
  return names;
}

}  // namespace unimapper::datasets
