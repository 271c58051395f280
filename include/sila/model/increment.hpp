#pragma once

#include <vector>

#include "sila/gp/sparse_gp.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// The result of one batch, M'(n): a model and the samples of each of its transitions. A stored model holds no raw
/// tracks; an increment does, until it is fused. Invariant: check(model); each list has an entry for each transition,
/// or is empty when the data are gone (model + model).
struct Increment {
  Model model;
  std::vector<GpData> samples;                ///< d_2 of the paper: positions [curb units], velocities [curb units/s]
  std::vector<GpData> residual_samples = {};  ///< of the residual GPs: states 6 x m, residuals m x 2 per knot
};

}  // namespace sila
