// Constants for tests with very many similar cases. Sanitizers make a build about ten times slower.
// In such a build, these tests run only every n-th case; the release build runs all cases.
#pragma once

#include <cstddef>

namespace shm {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif
#else
inline constexpr bool kSanitized = false;
#endif

/// True in a build with ThreadSanitizer. ThreadSanitizer checks the interaction of threads, not
/// their results, so that few cases are enough.
#if defined(__SANITIZE_THREAD__)
inline constexpr bool kWatchesThreads = true;
#else
inline constexpr bool kWatchesThreads = false;
#endif

/// True if tests run only a few of many similar cases. This applies to builds with sanitizers, and
/// to the preset `quick`, which is as slow because it does not optimize.
#if defined(SHM_FEW_CASES)
inline constexpr bool kFewCases = true;
#else
inline constexpr bool kFewCases = kSanitized;
#endif

/// Returns the distance from one selected case to the next: `n` if tests run few cases,
/// otherwise 1.
constexpr std::size_t every(std::size_t n) { return kFewCases ? n : 1; }

/// Selects the first of many similar cases, and every n-th case after it, in the order of calls. If
/// n has no divisor in common with the lengths of the nested loops, every value of each loop is
/// selected.
class SomeCases {
 public:
  explicit SomeCases(std::size_t n) : distance_(every(n)) {}
  bool skips_next() { return next_++ % distance_ != 0; }

 private:
  std::size_t distance_, next_ = 0;
};

}  // namespace shm
