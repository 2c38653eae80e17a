// Whether this build has sanitizers, which make all some ten times slower. Tests of very many like
// cases take every n-th of them then; the release build takes them all.
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

/// With ThreadSanitizer, which asks how threads go together and not what they compute: few cases
/// do.
#if defined(__SANITIZE_THREAD__)
inline constexpr bool kWatchesThreads = true;
#else
inline constexpr bool kWatchesThreads = false;
#endif

/// The preset quick is as slow, since nothing is optimized, and takes as few cases.
#if defined(SHM_FEW_CASES)
inline constexpr bool kFewCases = true;
#else
inline constexpr bool kFewCases = kSanitized;
#endif

/// 1, or where cases are few `n`: the distance from one case to the next.
constexpr std::size_t every(std::size_t n) { return kFewCases ? n : 1; }

/// Which of very many like cases to take: the first, and from there every n-th, as they come. An n
/// that has no divisor in common with the lengths of the loops meets all that each of them has.
class SomeCases {
 public:
  explicit SomeCases(std::size_t n) : distance_(every(n)) {}
  bool skips_next() { return next_++ % distance_ != 0; }

 private:
  std::size_t distance_, next_ = 0;
};

}  // namespace shm
