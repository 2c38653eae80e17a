// Whether this build has sanitizers, which make all some ten times slower. Tests of very many like
// cases take every n-th of them then; the release build takes them all.
#pragma once

#include <cstddef>

namespace shm {

#if defined(__SANITIZE_ADDRESS__)
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

/// 1, or with sanitizers `n`: the distance from one case to the next.
constexpr std::size_t every(std::size_t n) { return kSanitized ? n : 1; }

}  // namespace shm
