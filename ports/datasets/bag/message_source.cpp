#include "ports/datasets/bag/message_source.hpp"

#include <algorithm>
#include <queue>
#include <tuple>

#include "ports/datasets/bag/messages.hpp"

namespace unimapper::datasets::bag {

namespace {

/// "sensor_msgs/msg/PointCloud2", DDS' "sensor_msgs::msg::dds_::PointCloud2_" and
/// "sensor_msgs/PointCloud2" are the same.
std::string ros1_type(std::string_view type) {
  std::string name(type);
  for (std::size_t at = 0; (at = name.find("::", at)) != std::string::npos;)
    name.replace(at, 2, "/");
  if (const auto at = name.find("/dds_/"); at != std::string::npos) {
    name.replace(at, 6, "/");
    if (name.ends_with('_')) name.pop_back();
  }
  if (const auto at = name.find("/msg/"); at != std::string::npos) name.replace(at, 5, "/");
  return name;
}

auto order_in_file(const MessagePlace& place) {
  return std::tie(place.log_time_ns, place.file, place.block, place.offset);
}

}  // namespace

Serialization parse_serialization(std::string_view name) {
  if (name == "ros1") return Serialization::kRos1;
  if (name == "cdr") return Serialization::kCdr;
  return Serialization::kOther;
}

std::size_t MessageSource::add_topic(std::string_view name, std::string_view type,
                                     Serialization serialization) {
  Topic topic{std::string(name), ros1_type(type), serialization, 0};
  const auto [known, is_new] =
      topic_numbers_.try_emplace(std::tuple(topic.name, topic.type, serialization), topics_.size());
  if (!is_new) return known->second;
  is_read_.push_back(serialization != Serialization::kOther &&
                     kind_of(topic.type) != MessageKind::kOther);
  topics_.push_back(std::move(topic));
  places_.emplace_back();
  return topics_.size() - 1;
}

void MessageSource::add_message(std::size_t topic, const MessagePlace& place) {
  ++topics_.at(topic).message_count;
  if (is_read_.at(topic)) places_.at(topic).push_back(place);
}

void MessageSource::count_messages(std::size_t topic, std::uint64_t count) {
  topics_.at(topic).message_count += count;
}

void MessageSource::clear() {
  topics_.clear();
  topic_numbers_.clear();
  places_.clear();
  is_read_.clear();
}

void MessageSource::finish() {
  for (auto& places : places_) {
    std::sort(places.begin(), places.end(), [](const MessagePlace& a, const MessagePlace& b) {
      return order_in_file(a) < order_in_file(b);
    });
  }
}

void for_each_message(const MessageSource& source, std::span<const std::size_t> topics,
                      const std::function<void(std::size_t, std::size_t)>& visit) {
  struct Next {
    std::size_t topic;
    std::size_t number;
    const MessagePlace* place;
  };
  const auto is_later = [](const Next& a, const Next& b) {
    return order_in_file(*a.place) > order_in_file(*b.place);
  };
  std::priority_queue<Next, std::vector<Next>, decltype(is_later)> open(is_later);
  const auto put = [&](std::size_t topic, std::size_t number) {
    const auto& places = source.messages(topic);
    if (number < places.size()) open.push({topic, number, &places[number]});
  };
  for (const std::size_t topic : topics) put(topic, 0);
  while (!open.empty()) {
    const Next next = open.top();
    open.pop();
    visit(next.topic, next.number);
    put(next.topic, next.number + 1);
  }
}

}  // namespace unimapper::datasets::bag
