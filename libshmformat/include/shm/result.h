// Result: the outcome of a library call, a value or an Error. All errors have the same form: code,
// file, offset, section, and one sentence.
//
// The library throws no exceptions of its own. Only std::bad_alloc can leave a call that ran out of
// memory (with threads: the caller's call, in its turn), never a destructor or a move. Nothing
// leaks. Afterwards the object can only be destroyed or assigned to, and a file that it was writing
// is not finished. If a call returns a value, the value is correct.
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

/// Kind of a failure. The numbers are frozen: programs switch on them.
enum class ErrorCode : std::uint8_t {
  io = 1,       ///< the operating system failed to read
  truncated,    ///< the input ends before it should
  corrupt,      ///< the input contradicts itself or a checksum
  unsupported,  ///< the input is valid but needs something this build does not know
  over_limit,   ///< the input asks for more than the caller allowed
  misuse,       ///< the caller broke the contract of a call
  output,       ///< the output could not be written
};

inline constexpr std::uint64_t kNoOffset = ~std::uint64_t{0};

/// One failure. A plain value: copy it, keep it, print it.
struct Error {
  ErrorCode code = ErrorCode::corrupt;
  std::string detail = {};           ///< one sentence for people, without file and place
  std::string section = {};          ///< part of the file, e.g. "group 3, geometry" or "CELLS"
  std::uint64_t offset = kNoOffset;  ///< bytes from the start of the file, kNoOffset when unknown
  std::string file = {};             ///< path, empty when unknown

  /// "file: section, at byte N: detail", leaving out what is unknown.
  SHM_API std::string message() const;
};

/// Either a value or an Error. Move-only values are allowed. Never throws by itself. To ask an
/// Error for its value, or a value for its error, is a bug of the caller and ends the program
/// (std::terminate).
template <class T = void>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

  explicit operator bool() const noexcept { return state_.index() == 0; }
  /// Must hold: this is a value.
  T& value() & noexcept { return checked(std::get_if<0>(&state_)); }
  const T& value() const& noexcept { return checked(std::get_if<0>(&state_)); }
  T&& value() && noexcept { return std::move(checked(std::get_if<0>(&state_))); }
  T& operator*() & noexcept { return value(); }
  const T& operator*() const& noexcept { return value(); }
  T&& operator*() && noexcept { return std::move(*this).value(); }
  T* operator->() noexcept { return &value(); }
  const T* operator->() const noexcept { return &value(); }
  /// Must hold: this is a failure.
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
  Result() noexcept {}  // not = default, which would fill the storage of the Error with zeros
  Result(Error error) : error_(std::move(error)) {}

  explicit operator bool() const noexcept { return !error_.has_value(); }
  /// Must hold: this is a failure.
  const Error& error() const noexcept {
    if (!error_) std::terminate();
    return *error_;
  }

 private:
  std::optional<Error> error_;
};

}  // namespace shm
