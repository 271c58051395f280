#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <memory_resource>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "sila/core/trajectory.hpp"

namespace sila {

/// How a mode differs from the expected path of its roll-out (docs/decisions/0072-mode_variants.md).
enum class VariantKind { expected, slower, faster, left, right, wide };
inline constexpr const char* kVariantKinds[] = {"expected", "slower", "faster", "left", "right", "wide"};

/// One hypothesis of the future path, in the world frame.
struct Mode {
  double weight = 0.0;
  std::vector<Vector2> path_m;          ///< mean position at each time of the prediction
  std::vector<Matrix2> covariances_m2;  ///< of the position, positive definite; same length
  std::vector<int> primitives;          ///< visited, in order; empty for constant velocity
  VariantKind variant = VariantKind::expected;
  std::vector<std::size_t> sources = {};  ///< numbers of the merged roll-outs that it comes from, heaviest first

  bool operator==(const Mode&) const = default;
};

/// The region in which the person will be with a nominal probability: where the density of the modes is at least
/// exp(-level) times its peak (`nonconformity` at most `level`, refine/predictor.hpp). Past errors gave the levels.
struct Region {
  double probability = 0.0;
  std::vector<double> levels;  ///< at each time of the prediction
};

/// Probabilities of the regions of a prediction by a model with error statistics.
inline constexpr std::array<double, 4> kRegionProbabilities = {0.25, 0.5, 0.75, 0.9};

/// Invariant: at least one mode; weights >= 0, sum 1, in falling order; every path as long as `times_s`.
struct Prediction {
  double t0_s = 0.0;            ///< time of the last observed sample, on the clock of the input
  std::vector<double> times_s;  ///< of the steps, after t0
  std::vector<Mode> modes;
  std::vector<Region> regions;  ///< by rising probability
  bool fallback = false;        ///< no roll-outs: no transition matched, or nothing was learnt at this corner
  double novelty = 0.0;     ///< in [0, 1]: share of the people learnt so far whose path was better known than this one
  double observed_s = 0.0;  ///< time between the first and the last observed sample that was used
  bool standing = false;    ///< mean speed below 0.3 m/s while observed, or net speed below 0.17 m/s
  /// Probability that the motion has changed by each time: that a standing person has started (is 0.5 m away), that a
  /// walking one has stopped (slower than 0.3 m/s over 0.8 s). Empty before errors are known.
  std::vector<double> change_probabilities;
  Vector2 start_m = Vector2::Zero();  ///< position at t0, as it was estimated
  /// Unit vector: the direction of the last 0.8 s if the person walks, axis 1 of the site if the person stands; zero if
  /// neither is known.
  Vector2 heading = Vector2::Zero();
  bool mirrored = false;  ///< the axes of the site are mirrored: y points down, so that left of (1, 0) is (0, -1)
};

/// The modes' mean positions at the first `steps` times, by weight. Throws: std::invalid_argument if a mode is shorter.
std::vector<Vector2> mean_path(const Prediction& prediction, std::size_t steps);

/// Memory for the intermediate arrays of a prediction, released all at once. One for each thread; an array lives until
/// `reset`. Once the buffer is large enough, a prediction allocates nothing.
class Scratch {
 public:
  /// Numbers in it are not set; members of structs have their defaults.
  template <class T>
  std::span<T> array(std::size_t count) {
    static_assert(std::is_trivially_destructible_v<T>);
    used_ += count * sizeof(T) + alignof(T);
    T* first = std::pmr::polymorphic_allocator<T>(&*memory_).allocate(count);
    std::uninitialized_default_construct_n(first, count);
    return {first, count};
  }

  /// Releases every array; the buffer grows to the size that was used.
  void reset() {
    memory_.reset();
    if (used_ > size_) {
      size_ = 2 * used_;
      buffer_ = std::make_unique_for_overwrite<std::byte[]>(size_);
    }
    used_ = 0;
    memory_.emplace(buffer_.get(), size_);
  }

 private:
  std::size_t size_ = std::size_t{1} << 16;
  std::size_t used_ = 0;  ///< at most, with alignment
  std::unique_ptr<std::byte[]> buffer_ = std::make_unique_for_overwrite<std::byte[]>(size_);
  std::optional<std::pmr::monotonic_buffer_resource> memory_{std::in_place, buffer_.get(), size_};
};

/// Memory that is kept from one prediction to the next, so that the next need not allocate; one for each thread.
struct Workspace {
  Scratch scratch;
  Prediction prediction;    ///< the last one
  std::vector<Mode> spare;  ///< modes that the last prediction did not need; their memory is used again
};

}  // namespace sila
