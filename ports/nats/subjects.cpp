#include "ports/nats/subjects.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <vector>

#include "unimapper/wire/messages.hpp"

namespace unimapper::nats_port {

namespace {

template <typename Number>
bool read(std::string_view text, Number& number, int base = 10) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  return error == std::errc() && end == text.data() + text.size();
}

std::vector<std::string_view> tokens_of(std::string_view text) {
  std::vector<std::string_view> tokens;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('.', begin), text.size());
    tokens.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return tokens;
}

}  // namespace

bool is_site_name(std::string_view name) {
  const auto may_be_in = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), may_be_in);
}

std::string to_text(const Subject& subject) {
  const std::string session = "unimapper." + subject.site + "." +
                              std::to_string(subject.session.robot) + "." +
                              wire::to_text(subject.session.boot) + ".";
  return session + (subject.sequence ? "keyframe." + std::to_string(*subject.sequence) : "session");
}

std::optional<Subject> parse_subject(std::string_view text) {
  const std::vector<std::string_view> tokens = tokens_of(text);
  if (tokens.size() < 5 || !is_site_name(tokens[1]) || tokens[3].size() != 32) return std::nullopt;
  Subject subject{std::string(tokens[1]), {}, {}};
  std::uint32_t sequence = 0;
  const bool is_read = read(tokens[2], subject.session.robot) &&
                       read(tokens[3].substr(0, 16), subject.session.boot.high, 16) &&
                       read(tokens[3].substr(16), subject.session.boot.low, 16) &&
                       (tokens.size() < 6 || read(tokens[5], sequence));
  if (!is_read) return std::nullopt;
  if (tokens.size() > 5) subject.sequence = sequence;
  // Each has one text, which has nothing else in it.
  return to_text(subject) == text ? std::optional(subject) : std::nullopt;
}

}  // namespace unimapper::nats_port
