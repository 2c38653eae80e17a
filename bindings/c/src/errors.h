// Converts failures of the library to a status and a shmf_error. No exception leaves the C
// interface.
#pragma once

#include <cstdint>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

#include "shm/result.h"
#include "shmformat.h"

namespace shmf {

/// Error codes that exist only in the C interface, in addition to those of shm::ErrorCode.
inline constexpr auto kNoMemory = static_cast<shm::ErrorCode>(SHMF_NO_MEMORY);
inline constexpr auto kCancelled = static_cast<shm::ErrorCode>(SHMF_CANCELLED);

/// Returns the error for a call that violates the contract of its function.
inline shm::Error misuse(std::string detail, std::string section = {}) {
  return shm::Error{shm::ErrorCode::misuse, std::move(detail), std::move(section)};
}
/// Returns the error for a file whose parts contradict each other.
inline shm::Error corrupt(std::string detail, std::string section) {
  return shm::Error{shm::ErrorCode::corrupt, std::move(detail), std::move(section)};
}

/// Stores `why` in *error, unless `error` is null, and returns its status.
shmf_status report(shmf_error* error, const shm::Error& why);
shmf_status report_no_memory(shmf_error* error) noexcept;
shmf_status report_other(shmf_error* error, const char* what) noexcept;

/// Runs `call`, which returns a Result, and stores a failure or an exception in *error. Returns the
/// status.
template <class Call>
shmf_status guarded(shmf_error* error, Call&& call) noexcept {
  try {
    const auto done = std::forward<Call>(call)();
    return done ? SHMF_OK : report(error, done.error());
  } catch (const std::bad_alloc&) {
    return report_no_memory(error);
  } catch (const std::length_error&) {
    return report_no_memory(error);
  } catch (const std::exception& other) {
    return report_other(error, other.what());
  } catch (...) {
    return report_other(error, "an exception of an unknown kind");
  }
}

}  // namespace shmf
