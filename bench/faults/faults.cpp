#include "bench/faults/faults.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

#include "bench/faults/random.hpp"

namespace unimapper::bench {

namespace {

constexpr std::size_t kFragmentBytes = 1480;
constexpr std::size_t kUdpHeaderBytes = 8;
constexpr std::size_t kHeaderBytes = 28;  ///< of IP and UDP
constexpr double kCopyDelay_ms = 20.0;

double number_of(std::string_view text, std::string_view all) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= 0.0)) {
    throw std::invalid_argument(std::string(all) + ": \"" + std::string(text) + "\" is no number");
  }
  return value;
}

void set(LinkFaults& faults, std::string_view name, std::string_view value, std::string_view all) {
  const std::map<std::string_view, double LinkFaults::*> shares{
      {"drop", &LinkFaults::drop},
      {"fragments", &LinkFaults::fragment_drop},
      {"duplicate", &LinkFaults::duplicate},
      {"reorder", &LinkFaults::reorder},
      {"flip", &LinkFaults::flip}};
  const std::map<std::string_view, double LinkFaults::*> amounts{{"delay", &LinkFaults::delay_ms},
                                                                 {"hold", &LinkFaults::hold_ms},
                                                                 {"rate", &LinkFaults::rate},
                                                                 {"queue", &LinkFaults::queue}};
  if (const auto share = shares.find(name); share != shares.end()) {
    faults.*share->second = number_of(value, all);
    if (faults.*share->second > 1.0) {
      throw std::invalid_argument(std::string(all) + ": a share lies between 0 and 1");
    }
  } else if (const auto amount = amounts.find(name); amount != amounts.end()) {
    faults.*amount->second = number_of(value, all);
  } else if (const auto plus = value.find('+'); name == "down" && plus != std::string_view::npos) {
    faults.down_from_s = number_of(value.substr(0, plus), all);
    faults.down_for_s = number_of(value.substr(plus + 1), all);
  } else {
    throw std::invalid_argument(std::string(all) + ": unknown fault \"" + std::string(name) + "\"");
  }
}

}  // namespace

LinkFaults parse_faults(std::string_view text) {
  LinkFaults faults;
  const std::string_view all = text;
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find(','));
    text.remove_prefix(std::min(text.size(), one.size() + 1));
    const std::size_t equals = std::min(one.find('='), one.size());
    const std::string_view value = one.substr(std::min(one.size(), equals + 1));
    set(faults, one.substr(0, equals), value, all);
  }
  return faults;
}

std::size_t fragments_of(std::size_t bytes) {
  return (bytes + kUdpHeaderBytes + kFragmentBytes - 1) / kFragmentBytes;
}

Fate FaultyDirection::next(std::size_t bytes, double since_start_s) {
  Random random(seed_, number_++);
  Fate fate;
  // Every datagram draws the same numbers, so that one fault does not shift the others.
  const double drop = random.uniform();
  const double fragment = random.uniform();
  const double duplicate = random.uniform();
  const double reorder = random.uniform();
  const double flip = random.uniform();
  const double copy_delay = random.uniform();
  const std::uint64_t bit = random.bits();

  fate.down = since_start_s >= faults_.down_from_s &&
              since_start_s < faults_.down_from_s + faults_.down_for_s;
  const double all_fragments_arrive =
      std::pow(1.0 - faults_.fragment_drop, static_cast<double>(fragments_of(bytes)));
  if (fate.down || drop < faults_.drop || fragment >= all_fragments_arrive) {
    fate.copies = 0;
    return fate;
  }
  fate.copies = duplicate < faults_.duplicate ? 2 : 1;
  fate.reordered = reorder < faults_.reorder;
  fate.delay_ms[0] = faults_.delay_ms + (fate.reordered ? faults_.hold_ms : 0.0);
  if (!pass_bottleneck(bytes, since_start_s, fate.delay_ms[0])) fate.copies = 0;
  fate.delay_ms[1] = fate.delay_ms[0] + kCopyDelay_ms * copy_delay;
  if (flip < faults_.flip) fate.flip_bit = bit;
  return fate;
}

bool FaultyDirection::pass_bottleneck(std::size_t bytes, double since_start_s, double& delay_ms) {
  if (faults_.rate <= 0.0) return true;
  const double waiting_s = std::max(0.0, free_at_s_ - since_start_s);
  const auto size = static_cast<double>(bytes + kHeaderBytes);
  if (waiting_s > 0.0 && waiting_s * faults_.rate + size > faults_.queue) return false;
  free_at_s_ = since_start_s + waiting_s + size / faults_.rate;
  delay_ms += 1000.0 * (free_at_s_ - since_start_s);
  return true;
}

}  // namespace unimapper::bench
