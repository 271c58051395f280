#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <vector>

#include "gp/posterior.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/gp/sparse_gp.hpp"
#include "sila/model/model.hpp"
#include "sila/predict/prediction.hpp"
#include "sila/refine/config.hpp"

namespace sila {

/// The input of a residual GP at the end of an observed path.
ResidualInput residual_input(const CurbTrajectory& observed);

/// The sample of an observed path and its future, at one interval, if at least ResidualConfig::min_seen_share of the
/// horizon was seen; knots after the last seen position take the mean velocity until it.
std::optional<ResidualSample> residual_sample(const CurbTrajectory& observed, std::span<const Vector2> future_m,
                                              double interval_s, const ResidualSettings& settings);

/// Kernel and noise of residual GPs, in curb units.
Hyperparameters residual_hyperparameters(const ModelSettings& settings, const ResidualConfig& config);

/// Settings of residual GPs as sparse GPs. Their mean is zero, so that far from all samples the prediction is constant
/// velocity.
GpConfig residual_gp_config(const ResidualConfig& config);

/// The residual GPs of a model, prepared once for many predictions.
class ResidualIndex {
 public:
  /// The residual GP of a transition.
  struct Expert {
    Posterior posterior;
    Eigen::AlignedBox<double, kResidualInputs> reach;  ///< beyond it the GP is its prior
  };

  /// Posteriors of GPs that are equal in an earlier model are taken from its index.
  ResidualIndex(const Model& model, const Model* earlier = nullptr, const ResidualIndex* of_earlier = nullptr);

  const std::optional<Expert>& expert(int transition) const { return experts_[static_cast<std::size_t>(transition)]; }
  int knots() const { return knots_; }
  double horizon_s() const { return horizon_s_; }

 private:
  int knots_ = 0;
  double horizon_s_ = 0.0;
  std::vector<std::optional<Expert>> experts_;
};

/// A velocity at `seconds`, of those at knots `interval_s` apart, the first after one interval, one a column: linear
/// between knots, constant before the first and after the last. Zero without knots.
Vector2 interpolated(const Eigen::Ref<const Eigen::Matrix2Xd>& knots_mps, double interval_s, double seconds);

/// Predicted deviation of a path from constant velocity.
struct ResidualPrediction {
  std::span<const double> residuals_mps;  ///< world frame, x and y at each knot; none if the model has no residual GPs
  double knot_interval_s = 1.0;
  double effective_samples = 0.0;  ///< effective number of samples of all experts together

  /// Mean velocity from t0 to `seconds` later minus constant velocity [m/s].
  Vector2 residual_mps(double seconds) const {
    const auto knots = static_cast<Eigen::Index>(residuals_mps.size() / 2);
    return interpolated(Eigen::Matrix2Xd::Map(residuals_mps.data(), 2, knots), knot_interval_s, seconds);
  }
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
