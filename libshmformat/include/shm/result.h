// Result: the outcome of a library call, which is a value or an Error. All errors have the same
// form: code, file, offset, section, and one sentence.
//
// The library throws no exceptions except std::bad_alloc. The call that ran out of memory throws
// it. Destructors and moves never throw it. If a thread of the library runs out of memory, the
// exception is thrown in the caller's thread, by the call that needs the result of that thread. No
// memory or other resources leak. Afterwards the object can only be destroyed or assigned to, and a
// file that it was writing remains unfinished. If a call returns a value, the value is correct.
#pragma once

#if __cplusplus < 202002L
#error "libshmformat needs C++20: compile with -std=c++20"
#endif

#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#if defined(SHM_STATIC) || defined(_WIN32)
#define SHM_API
#else
#define SHM_API __attribute__((visibility("default")))
#endif

namespace shm {

/// Kind of a failure. The numbers are frozen, because programs switch on them.
enum class ErrorCode : std::uint8_t {
  io = 1,       ///< the operating system failed to read
  truncated,    ///< the input ends before it should
  corrupt,      ///< the input contradicts itself or a checksum
  unsupported,  ///< the input is valid but needs a feature that this build does not support
  over_limit,   ///< decoding the input would exceed the caller's limits
  misuse,       ///< the caller violated the contract of a call
  output,       ///< the output could not be written
};

inline constexpr std::uint64_t kNoOffset = ~std::uint64_t{0};

/// A failure. Objects of this type are plain values: they can be copied, stored and printed.
struct Error {
  ErrorCode code = ErrorCode::corrupt;
  std::string detail = {};   ///< one human-readable sentence, without the file and the position
  std::string section = {};  ///< part of the file, e.g. "group 3, geometry" or "CELLS"
  std::uint64_t offset = kNoOffset;  ///< byte offset in the file, kNoOffset if unknown
  std::string file = {};             ///< path, empty if unknown

  /// Returns "file: section, at byte N: detail", without the unknown parts.
  SHM_API std::string message() const;
};

/// Either a value or an Error. The value may be of a move-only type. A Result never throws by
/// itself. Requesting the value of an Error, or the error of a value, is a bug in the calling code
/// and ends the program (std::terminate).
template <class T = void>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

  explicit operator bool() const noexcept { return state_.index() == 0; }
  /// Precondition: the result is a value.
  T& value() & noexcept { return checked(std::get_if<0>(&state_)); }
  const T& value() const& noexcept { return checked(std::get_if<0>(&state_)); }
  T&& value() && noexcept { return std::move(checked(std::get_if<0>(&state_))); }
  T& operator*() & noexcept { return value(); }
  const T& operator*() const& noexcept { return value(); }
  T&& operator*() && noexcept { return std::move(*this).value(); }
  T* operator->() noexcept { return &value(); }
  const T* operator->() const noexcept { return &value(); }
  /// Precondition: the result is an Error.
  const Error& error() const noexcept { return checked(std::get_if<1>(&state_)); }

 private:
  template <class Held>
  static Held& checked(Held* held) noexcept {
    if (held == nullptr) std::terminate();
    return *held;
  }
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() noexcept {}  // not defaulted, because that would zero the storage of the Error
  Result(Error error) : error_(std::move(error)) {}

  explicit operator bool() const noexcept { return !error_.has_value(); }
  /// Precondition: the result is an Error.
  const Error& error() const noexcept {
    if (!error_) std::terminate();
    return *error_;
  }

 private:
  std::optional<Error> error_;
};

}  // namespace shm
