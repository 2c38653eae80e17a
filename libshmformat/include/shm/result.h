// Result: how every call of the library says that it worked or why it did not.
// One error shape everywhere: code, file, offset, section, sentence.
// The library throws nothing of its own. Only where memory runs out std::bad_alloc comes out of the
// call that wanted it (with threads: out of the caller's call, in its turn), never out of a
// destructor or a move. Nothing leaks; of the object that was called all that is left is to destroy
// it or to assign to it, and its file is not finished. What a call gives that returns is right.
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

/// What kind of failure this is. The numbers are frozen: programs switch on them.
enum class ErrorCode : std::uint8_t {
  io = 1,       ///< the operating system refused to read
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
  std::string detail;                ///< one sentence for people, without file and place
  std::string section;               ///< part of the file, e.g. "group 3, geometry" or "CELLS"
  std::uint64_t offset = kNoOffset;  ///< bytes from the start of the file, kNoOffset when unknown
  std::string file;                  ///< path, empty when unknown

  /// "file: section, at byte N: detail", leaving out what is unknown.
  SHM_API std::string message() const;
};

/// Either a value or an Error. Move-only values are fine. Never throws by itself: to ask an Error
/// for its value, or a value for its error, is a bug of the caller, and ends the program
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
  Result() noexcept {}  // by hand: = default would fill the room for an Error with zeros
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
