#pragma once

#include <Eigen/Core>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// Position, velocity of the last 0.8 s, mean velocity of the last 3 s: curb coordinates.
inline constexpr int kResidualInputs = 6;
using ResidualInput = Eigen::Matrix<double, kResidualInputs, 1>;

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
};

/// The samples of one transition in this batch, d_2 of the paper.
struct TransitionSamples {
  Eigen::MatrixXd positions;       ///< 2 x n [curb units]
  Eigen::MatrixXd velocities;      ///< n x 2 [curb units/s]
  Eigen::MatrixXd states = {};     ///< 6 x m: of the residual GP's examples
  Eigen::MatrixXd residuals = {};  ///< m x 2 per knot
};

/// The result of one batch, M'(n): a model and the samples of each of its transitions. A stored model holds no raw
/// tracks; an increment does, until it is fused. Invariant: check(model); samples.size() == model.transitions.size(),
/// or samples is empty when the data are gone (model + model).
struct Increment {
  Model model;
  std::vector<TransitionSamples> samples;
};

}  // namespace sila
