#pragma once

#include <Eigen/Core>
#include <vector>

#include "sila/model/gait.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// The samples of one transition in this batch, d_2 of the paper.
struct TransitionSamples {
  Eigen::MatrixXd positions;      ///< 2 x n [sidewalk widths]
  Eigen::MatrixXd velocities;     ///< n x 2 [widths/s]
  Eigen::MatrixXd states = {};    ///< 6 x m: of the outlook's examples
  Eigen::MatrixXd partings = {};  ///< m x 2 per knot
};

/// What one batch taught, M'(n): a model and the samples of each of its transitions. A stored model holds no raw
/// tracks; an increment does, until it is fused. Invariant: check(model); samples.size() == model.transitions.size(),
/// or samples is empty when the data are gone (model + model).
struct Increment {
  Model model;
  std::vector<TransitionSamples> samples;
  GaitSamples gait = {};  ///< those of the model's gait
};

}  // namespace sila
