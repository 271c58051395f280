#pragma once

#include <Eigen/Core>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/model/model.hpp"
#include "sila/model/residual.hpp"

namespace sila {

/// The tracks of one episode as they are learnt from. Invariant: `residuals` is empty, or has a list for each track.
struct Batch {
  std::vector<CurbTrajectory> tracks;  ///< curb coordinates, at the interval of the settings
  std::vector<std::vector<ResidualSample>> residuals;
};

/// The samples of one transition in this batch, d_2 of the paper.
struct TransitionSamples {
  Eigen::MatrixXd positions;       ///< 2 x n [curb units]
  Eigen::MatrixXd velocities;      ///< n x 2 [widths/s]
  Eigen::MatrixXd states = {};     ///< 6 x m: of the residual GP's examples
  Eigen::MatrixXd residuals = {};  ///< m x 2 per knot
};

/// What one batch fitted, M'(n): a model and the samples of each of its transitions. A stored model holds no raw
/// tracks; an increment does, until it is fused. Invariant: check(model); samples.size() == model.transitions.size(),
/// or samples is empty when the data are gone (model + model).
struct Increment {
  Model model;
  std::vector<TransitionSamples> samples;
  std::vector<GlobalResidualSamples> global_residuals =
      {};  ///< those of the global residual GP of each site; or empty, as `samples`
};

}  // namespace sila
