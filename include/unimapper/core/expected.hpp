// Value or error, for code that is built without exceptions.
#pragma once

#include <cstdint>
#include <utility>

#include "unimapper/core/assert.hpp"

namespace unimapper {

/// Why a call was refused. Every code has one sentence a user understands: `describe()`.
enum class ErrorCode : std::uint8_t {
  kOk = 0,
  kInvalidConfig,     ///< a configuration member is outside its documented range
  kMemoryTooSmall,    ///< the caller's block is smaller than `required_bytes(config)`
  kMemoryMisaligned,  ///< the caller's block does not start on a 64-byte boundary
  kInvalidPose,       ///< the pose holds NaN/Inf or its rotation is not a rotation
  kTimeReversed,      ///< the stamp is not later than the one before
  kEmptyScan,         ///< no point of the scan is finite and within the sensor's range
  kPoseJump,          ///< the pose moved farther than the configured limit since the last scan
  kCapacityExceeded,  ///< a fixed-capacity container is full
  kInvalidKeyframe,   ///< what was handed over is no keyframe
  kBufferTooSmall,    ///< the result needs more bytes than the caller's buffer has
  kTimeJump,          ///< the stamp lies far ahead, or the clock was set back
};

/// An error as a value: a code, and a static sentence that says what to do about it. Must be used.
struct [[nodiscard]] Error {
  ErrorCode code = ErrorCode::kOk;  ///< the kind of error; `kOk`: none
  const char* message = "";         ///< static text, never null; empty if there is no error

  /// Whether there is no error.
  [[nodiscard]] constexpr bool ok() const noexcept { return code == ErrorCode::kOk; }
};

/// A must-use value or error. `T` must be default constructible and movable.
/// No heap, no exceptions. Asking for the value of an error is a programming mistake and stops the
/// program (see `UNIMAPPER_ASSERT`): no default value is ever mistaken for a result.
template <typename T>
class [[nodiscard]] Expected {
 public:
  Expected(T value) noexcept : value_(std::move(value)) {}  // NOLINT: implicit by design
  Expected(Error error) noexcept : error_(error) {}         // NOLINT: implicit by design

  /// Whether there is a value.
  [[nodiscard]] bool ok() const noexcept { return error_.ok(); }
  explicit operator bool() const noexcept { return ok(); }

  /// Only where `ok()`.
  [[nodiscard]] T& value() noexcept {
    UNIMAPPER_ASSERT(ok(), error_.message);
    return value_;
  }
  /// Only where `ok()`.
  [[nodiscard]] const T& value() const noexcept {
    UNIMAPPER_ASSERT(ok(), error_.message);
    return value_;
  }
  T& operator*() noexcept { return value(); }
  const T& operator*() const noexcept { return value(); }
  T* operator->() noexcept { return &value(); }
  const T* operator->() const noexcept { return &value(); }
  /// `kOk` where there is a value.
  [[nodiscard]] const Error& error() const noexcept { return error_; }

 private:
  T value_{};
  Error error_{};
};

}  // namespace unimapper
