#pragma once

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SILA_SANITIZED 1
#endif
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SILA_SANITIZED 1
#endif
#ifndef SILA_SANITIZED
#define SILA_SANITIZED 0  ///< whether this build has a sanitizer for memory or threads
#endif

namespace sila::testing {

/// How often something random is repeated: an eighth under a sanitizer, which is that much slower and looks for other
/// mistakes than the numbers that the plain build compares.
constexpr int repeats(int plain) {
  return SILA_SANITIZED ? (plain + 7) / 8 : plain;
}

}  // namespace sila::testing
