#include "ports/datasets/bag/bag_gyroscope.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "ports/datasets/bag/messages.hpp"
#include "ports/datasets/bag/topic_choice.hpp"

namespace unimapper::datasets::bag {
namespace {

/// A topic of an IMU whose axes may be known.
struct Imu {
  std::size_t topic;
  std::string frame;  // of its first message that can be read
  std::optional<Eigen::Matrix3d> R_lidar_imu;
};

std::string frame_of(MessageSource& source, std::size_t topic) {
  for (const MessagePlace& place : source.messages(topic)) {
    try {
      return decode_header(source.read(place, kHeaderBytes), source.topics()[topic].serialization)
          .frame;
    } catch (const DatasetError&) {
      continue;  // counted where the samples are read
    }
  }
  return {};
}

std::optional<Eigen::Matrix3d> rotation_between(const TransformTree& transforms,
                                                const std::string& lidar, const std::string& imu) {
  if (imu.empty()) return std::nullopt;
  if (imu == lidar) return Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  if (!transforms.is_rigid(lidar, imu)) return std::nullopt;
  const auto T_lidar_imu = transforms.lookup(lidar, imu, 0);  // the same at any time
  return T_lidar_imu ? std::optional(T_lidar_imu->rotation) : std::nullopt;
}

/// "/ouster/points" and "/ouster/imu" are of one sensor; the root is no sensor's.
bool share_namespace(const std::string& scans, const std::string& imu) {
  const std::size_t end = scans.rfind('/');
  return end != std::string::npos && end > 0 && imu.starts_with(scans.substr(0, end + 1));
}

/// The IMUs that fit best: several where they fit as well as each other.
std::vector<Imu> best_of(const std::vector<Imu>& imus, const MessageSource& source,
                         const ImuWish& wish) {
  std::vector<Imu> best;
  int best_fit = -1;
  for (const Imu& imu : imus) {
    if (!imu.R_lidar_imu) continue;
    const int fit = imu.frame == wish.lidar_frame                                       ? 2
                    : share_namespace(wish.scan_topic, source.topics()[imu.topic].name) ? 1
                                                                                        : 0;
    if (fit > best_fit) best.clear();
    best_fit = std::max(fit, best_fit);
    if (fit == best_fit) best.push_back(imu);
  }
  return best;
}

std::string list_of(const std::vector<Imu>& imus, const MessageSource& source) {
  std::string list;
  for (const Imu& imu : imus) {
    list += (list.empty() ? "" : ", ") + describe(source.topics()[imu.topic]) + " of '" +
            imu.frame + "'";
  }
  return list;
}

/// What is left out of the samples, and why.
struct LeftOut {
  std::size_t unreadable = 0;
  std::size_t without_velocity = 0;
  std::size_t of_other_frames = 0;
  std::string first_reason;

  void note(const std::string& topic, std::vector<Note>& notes) const {
    const std::size_t all = unreadable + without_velocity + of_other_frames;
    if (all == 0) return;
    notes.push_back({"gyroscope: " + std::to_string(all) + " messages of " + topic +
                         " are left out: " + std::to_string(unreadable) + " cannot be read" +
                         (first_reason.empty() ? "" : " (the first " + first_reason + ")") + ", " +
                         std::to_string(without_velocity) + " have no angular velocity, " +
                         std::to_string(of_other_frames) + " are of another frame",
                     true});
  }
};

void read_samples(MessageSource& source, const Imu& imu, RecordedGyroscope& gyroscope) {
  const Topic& topic = source.topics()[imu.topic];
  LeftOut left_out;
  for (const MessagePlace& place : source.messages(imu.topic)) {
    try {
      const ImuMessage message = decode_imu(source.read(place), topic.serialization);
      if (message.header.frame != imu.frame) {
        ++left_out.of_other_frames;
      } else if (!message.rad_s) {
        ++left_out.without_velocity;
      } else {
        const std::int64_t stamp_ns = message.header.stamp_ns;
        gyroscope.samples.push_back({stamp_ns != 0 ? stamp_ns : place.log_time_ns,
                                     *imu.R_lidar_imu * *message.rad_s,
                                     *imu.R_lidar_imu * message.acceleration});
      }
    } catch (const DatasetError& error) {
      if (left_out.unreadable++ == 0) left_out.first_reason = error.what();
    }
  }
  std::stable_sort(gyroscope.samples.begin(), gyroscope.samples.end(),
                   [](const auto& a, const auto& b) { return a.stamp_ns < b.stamp_ns; });
  left_out.note(topic.name, gyroscope.notes);
}

}  // namespace

RecordedGyroscope read_gyroscope(MessageSource& source, const TransformTree& transforms,
                                 const ImuWish& wish) {
  RecordedGyroscope gyroscope;
  if (wish.topic == "off") return gyroscope;
  std::vector<Imu> imus;
  for (const std::size_t topic : choose_imu_topics(source, wish.topic)) {
    const std::string frame = frame_of(source, topic);
    imus.push_back({topic, frame, rotation_between(transforms, wish.lidar_frame, frame)});
  }
  if (imus.empty()) return gyroscope;
  const std::vector<Imu> best = best_of(imus, source, wish);
  if (best.empty()) {
    const std::string unknown = "no fixed transform between the LiDAR's frame '" +
                                wish.lidar_frame + "' and that of " + list_of(imus, source) +
                                " is in the bag";
    if (!wish.topic.empty()) throw DatasetError("--imu-topic: " + unknown);
    gyroscope.notes.push_back({"gyroscope: none is used: " + unknown, false});
    return gyroscope;
  }
  if (best.size() > 1) {
    gyroscope.notes.push_back({"gyroscope: none is used, as several fit: " + list_of(best, source) +
                                   "; choose one with --imu-topic",
                               false});
    return gyroscope;
  }
  gyroscope.description = describe(source.topics()[best.front().topic]);
  read_samples(source, best.front(), gyroscope);
  return gyroscope;
}

}  // namespace unimapper::datasets::bag
