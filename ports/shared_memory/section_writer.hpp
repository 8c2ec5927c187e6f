// Writer of a message's sections.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "ports/shared_memory/contents.hpp"
#include "unimapper/core/ids.hpp"

namespace unimapper::shared_memory {

/// The next multiple of 8.
[[nodiscard]] constexpr std::uint64_t aligned(std::uint64_t bytes) noexcept {
  return (bytes + 7) / 8 * 8;
}

/// Head of a message of so many bytes.
[[nodiscard]] inline ContentHead head_of(ContentKind kind, std::uint64_t bytes,
                                         const SessionId& session, std::uint32_t number) noexcept {
  return {kContentMagic,     static_cast<std::uint16_t>(kind),
          kContentVersion,   bytes,
          session.boot.high, session.boot.low,
          session.robot,     number};
}

/// Lays sections one behind the other and fills them; without memory it only counts.
class SectionWriter {
 public:
  /// The first section lies `begin` bytes from the message's first byte.
  SectionWriter(std::size_t begin, std::span<std::byte> out) noexcept : out_(out), at_(begin) {}

  /// Elements as they are.
  template <typename Element, typename Source>
  Section copy(std::span<const Source> elements) noexcept {
    static_assert(sizeof(Element) == sizeof(Source));
    const Section section = add(elements.size(), sizeof(Element));
    if (fits() && !elements.empty()) {
      std::memcpy(out_.data() + section.offset, static_cast<const void*>(elements.data()),
                  elements.size_bytes());
    }
    return section;
  }
  /// Elements one by one, as `converted` makes them.
  template <typename Source, typename Converted>
  Section convert(std::span<const Source> elements, const Converted& converted) noexcept {
    using Element = decltype(converted(elements[0]));
    const Section section = add(elements.size(), sizeof(Element));
    if (!fits()) return section;
    std::byte* to = out_.data() + section.offset;
    for (const Source& source : elements) {
      const Element element = converted(source);
      std::memcpy(to, &element, sizeof element);
      to += sizeof element;
    }
    return section;
  }

  /// Of the message so far.
  [[nodiscard]] std::uint64_t bytes() const noexcept { return at_; }
  /// Whether there is memory for it.
  [[nodiscard]] bool fits() const noexcept { return at_ <= out_.size(); }

 private:
  Section add(std::size_t count, std::size_t stride) noexcept {
    const Section section{static_cast<std::uint32_t>(at_), static_cast<std::uint32_t>(count),
                          static_cast<std::uint32_t>(stride), 0};
    at_ = aligned(at_ + std::uint64_t{count} * stride);
    return section;
  }

  std::span<std::byte> out_;
  std::uint64_t at_;
};

}  // namespace unimapper::shared_memory
