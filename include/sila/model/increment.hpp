#pragma once

#include <Eigen/Core>
#include <vector>

#include "sila/gp/sparse_gp.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// The samples of one transition in this batch, d_2 of the paper.
struct TransitionSamples {
  Eigen::MatrixXd positions;   ///< 2 x n [curb units]
  Eigen::MatrixXd velocities;  ///< n x 2 [curb units/s]
};

/// The result of one batch, M'(n): a model and the samples of each of its transitions. A stored model holds no raw
/// tracks; an increment does, until it is fused. Invariant: check(model); each list has an entry for each transition,
/// or is empty when the data are gone (model + model).
struct Increment {
  Model model;
  std::vector<TransitionSamples> samples;
  std::vector<GpData> residual_samples = {};  ///< of the residual GPs: states 6 x m, residuals m x 2 per knot
};

}  // namespace sila
