// Converts failures of the library to a status and a shmf_error, and keeps exceptions from leaving
// a call.
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

/// Codes in addition to shm::ErrorCode.
inline constexpr auto kNoMemory = static_cast<shm::ErrorCode>(SHMF_NO_MEMORY);
inline constexpr auto kCancelled = static_cast<shm::ErrorCode>(SHMF_CANCELLED);

/// Error of a call that breaks the contract.
inline shm::Error misuse(std::string detail, std::string section = {}) {
  return shm::Error{shm::ErrorCode::misuse, std::move(detail), std::move(section)};
}
/// Error of a file that disagrees with its index.
inline shm::Error corrupt(std::string detail, std::string section) {
  return shm::Error{shm::ErrorCode::corrupt, std::move(detail), std::move(section)};
}

/// Fills *error, unless it is null, and returns its status.
shmf_status report(shmf_error* error, const shm::Error& why);
shmf_status report_no_memory(shmf_error* error) noexcept;
shmf_status report_other(shmf_error* error, const char* what) noexcept;

/// Runs `call`, which returns a Result, and reports a failure in *error.
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
