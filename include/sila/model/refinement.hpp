#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/gp/sparse_gp.hpp"
#include "sila/model/error_statistics.hpp"

namespace sila {

/// Position, velocity of the last 0.8 s, mean velocity of the last 3 s: curb coordinates.
inline constexpr int kResidualInputs = 6;
using ResidualInput = Eigen::Matrix<double, kResidualInputs, 1>;

/// Settings of residual GPs that stay the same for the life of a model.
struct ResidualSettings {
  double horizon_s = 0.0;  ///< time ahead that they reach; 0 if the model has none
  int knots = 0;           ///< number of evenly spaced times until that horizon

  bool operator==(const ResidualSettings&) const = default;
};

/// What a model has beside the paper's (docs/method.md, section 2): residual GPs, and statistics of past errors.
/// Invariant, a part of `check(model)`: each list is empty or has an entry for each transition or site of the model.
struct Refinement {
  ResidualSettings residual_settings;
  std::vector<SparseGp> residuals;                ///< of each transition; no points: no data (src/refine/residual.hpp)
  std::vector<ErrorStatistics> error_statistics;  ///< of predictions at each site; constant size
  /// Error statistics of other places, which count at each site like at most 200 of its own windows; empty without them
  /// (sila/refine/prune.hpp).
  ErrorStatistics prior;
};

/// The entry of a transition or site in a list of the refinement; an empty one if the list is empty.
template <class Part>
const Part& entry_of(const std::vector<Part>& list, std::size_t index) {
  static const Part none;
  return index < list.size() ? list[index] : none;
}

/// The error statistics of one site, apart from a model.
struct SiteErrors {
  CurbFrame frame;
  ErrorStatistics statistics;
};

/// The motion of a track until t0, and its deviation from constant velocity after t0.
struct ResidualSample {
  double t0_s = 0.0;
  ResidualInput state = ResidualInput::Zero();
  /// Mean velocity from t0 to each knot minus constant velocity [curb units/s]: x, y of the first knot, second, ...
  Eigen::VectorXd residuals;
};

/// The tracks of one episode as they are learnt from. Invariant: `residuals` is empty, or has a list for each track.
struct Batch {
  std::vector<CurbTrajectory> tracks;  ///< curb coordinates, at the interval of the settings
  std::vector<std::vector<ResidualSample>> residuals;
  ResidualSettings residual_settings;
};

}  // namespace sila
