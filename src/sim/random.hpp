#pragma once

#include <cstdint>
#include <random>

namespace sila::sim {

/// Draws that are the same on every platform: the standard fixes the engine, but not its distributions, nor the last
/// bit of log and cos; so these use additions and products only.
class Random {
 public:
  /// `stream` separates independent sequences of one seed.
  Random(std::uint64_t seed, std::uint64_t stream) : engine_(mix(mix(seed) + stream)) {}

  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  bool chance(double probability) { return uniform() < probability; }

  /// Mean 0, variance 1: the sum of twelve uniforms (Irwin-Hall), which ends at 6 standard deviations.
  double normal() {
    std::uint64_t sum = 0;
    for (int word = 0; word < 3; ++word) {
      const std::uint64_t bits = engine_();
      sum += (bits & 0xffff) + ((bits >> 16) & 0xffff) + ((bits >> 32) & 0xffff) + (bits >> 48);
    }
    return (static_cast<double>(sum) + 6.0) * 0x1p-16 - 6.0;
  }

 private:
  /// The finaliser of SplitMix64: neighbouring seeds give unrelated engines.
  static std::uint64_t mix(std::uint64_t value) {
    value += 0x9e3779b97f4a7c15ULL;
    value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9ULL;
    value = (value ^ (value >> 27)) * 0x94d049bb133111ebULL;
    return value ^ (value >> 31);
  }

  std::mt19937_64 engine_;
};

}  // namespace sila::sim
