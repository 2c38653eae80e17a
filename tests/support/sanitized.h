// Constants for tests that run very many similar cases. Builds with sanitizers are about ten times
// slower, so in these builds the tests run only every n-th case. The release build runs all cases.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

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

/// True in a build with ThreadSanitizer, which checks how threads interact. A few cases are
/// sufficient for that.
#if defined(__SANITIZE_THREAD__)
inline constexpr bool kWatchesThreads = true;
#else
inline constexpr bool kWatchesThreads = false;
#endif

/// True if tests run only a few of many similar cases, i.e. in builds with sanitizers and in the
/// preset `quick`. That preset does not optimize, so its tests are equally slow.
#if defined(SHM_FEW_CASES)
inline constexpr bool kFewCases = true;
#else
inline constexpr bool kFewCases = kSanitized;
#endif

/// Returns the increment for a loop over test cases: `n` if tests run only a few cases, otherwise
/// 1.
constexpr std::size_t every(std::size_t n) { return kFewCases ? n : 1; }

/// Returns true if tests of the corpus should use the file with this name. If the environment
/// variable SHM_SHARE is N, a hash of the name and of SHM_SEED selects one in N files on average.
/// If kFewCases is true, it selects one in 3N files. folder_test.py does the same for Python tests.
inline bool is_sampled(std::string_view name) {
  const char* share = std::getenv("SHM_SHARE");
  const char* seed = std::getenv("SHM_SEED");
  std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a
  for (const std::string_view text : {std::string_view(seed == nullptr ? "" : seed), name})
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  const std::uint64_t every_nth = share == nullptr ? 1 : std::strtoull(share, nullptr, 10);
  return (hash >> 32) % (std::max<std::uint64_t>(every_nth, 1) * every(3)) == 0;
}

/// Selects every n-th of many similar cases, beginning with the first. The cases are numbered in
/// the order of the calls to skips_next(). If the calls are in nested loops, n should be coprime to
/// the lengths of the loops, so that every value of each loop variable occurs in some selected
/// case.
class SomeCases {
 public:
  explicit SomeCases(std::size_t n) : distance_(every(n)) {}
  bool skips_next() { return next_++ % distance_ != 0; }

 private:
  std::size_t distance_, next_ = 0;
};

}  // namespace shm
