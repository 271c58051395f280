#pragma once

#include <span>

#include "refine/residual_index.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/predict/prediction.hpp"

namespace sila {

/// Predicted deviation of a path from constant velocity.
struct ResidualPrediction {
  std::span<const Vector2> residuals_mps;  ///< world frame, at each knot; none if the model has no residual GPs
  double knot_interval_s = 1.0;
  double effective_samples = 0.0;  ///< effective number of samples of all experts together

  /// Mean velocity from t0 to `seconds` later minus constant velocity [m/s]; linear between knots, constant before the
  /// first and after the last.
  Vector2 residual_mps(double seconds) const;
};

/// The prediction of one transition's residual GP, as terms of the sums of the committee (`combine`).
struct ExpertPrediction {
  int transition = 0;
  double gain = 0.0;                      ///< of precision, relative to the prior's
  double effective_samples = 0.0;         ///< effective number of samples
  std::span<const double> weighted_mean;  ///< mean times relative precision, curb coordinates
};
/// The predictions of the transitions nearby that have a residual GP which explains something here.
std::span<const ExpertPrediction> predict_experts(const ResidualIndex& index, std::span<const int> near,
                                                  const CurbTrajectory& observed, Scratch& scratch);

/// Combines experts that were trained on different people: their precisions beyond that of the prior add, and each mean
/// is weighted by its precision. Experts in `excluded` are left out, because they belong to another mode.
/// Source: Tresp 2000, Bayesian committee machine; docs/decisions/0070-residuals.md.
ResidualPrediction combine(const ResidualIndex& index, const CurbTrajectory& observed,
                           std::span<const ExpertPrediction> experts, std::span<const int> excluded, Scratch& scratch);

}  // namespace sila
