#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>

#include "core/kinematics.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/model/error_statistics.hpp"

namespace sila {

using HazardFeatures = Eigen::Matrix<double, kHazardFeatures, 1>;

/// The features of the hazard of a change of motion, with zeros for those of the time ahead. The position is rounded to
/// a lattice of 0.5 m. Units: past velocities, the predicted mean velocity until the horizon and the mean observed
/// speed [m/s], the time that the person has stayed in place [s], and the position from the corner of the site [m].
HazardFeatures hazard_features(const PastVelocities& past_mps, const Vector2& predicted_mps, double mean_speed_mps,
                               double still_s, const Vector2& position_m);

/// The step after t0, from 0, in which a person changes their motion; none if the recorded future has no change. A
/// standing person starts in the first step that ends more than kStandingReach_m from the position at t0. A walking
/// person stops in the first step at whose end the displacement of the last 0.8 s is slower than 0.3 m/s. Units: raw
/// positions [m], `interval_s` apart; the last of `past_m` is at t0.
std::optional<std::size_t> change_step(std::size_t state, std::span<const Vector2> past_m,
                                       std::span<const Vector2> future_m, double interval_s);

/// A window with a recorded future. `change`: see change_step; `steps`: number of steps that were recorded.
struct ChangeWindow {
  HazardFeatures features;
  std::optional<std::size_t> change;
  std::size_t steps = 0;
};

/// When a standing person starts, or a walking person stops. The hazard of a step is the probability of the change in
/// that step if there was none before. It is a logistic regression (discrete-time survival model, Cox 1972; Allison
/// 1982) on the motion and on random Fourier features of the position at the site. The regression is learnt online:
/// each episode adds its moments about the mode of the posterior with it (sequential Laplace approximation,
/// Spiegelhalter and Lauritzen 1990), so that the sums have a constant size and add exactly. Source: none in the paper;
/// docs/decisions/0113-starting-and-stopping.md, 0134-newton-steps.md.
class MotionChange {
 public:
  /// `state`: kStanding for the hazard of starting, kWalking for that of stopping.
  MotionChange(const RegressionMoments& moments, std::size_t state, double interval_s);

  /// Probability that the change has come by the end of each step: non-decreasing.
  void probabilities(const HazardFeatures& features, std::span<double> by_step) const;
  /// The moments of these windows. Newton steps with them lead from this estimate to that about which they are taken.
  RegressionMoments moments_of(std::span<const ChangeWindow> windows) const;

 private:
  Eigen::Vector3d powers_of(std::size_t step) const;
  RegressionMoments moments_here(std::span<const ChangeWindow> windows) const;
  void add_window(RegressionMoments& moments, const ChangeWindow& window) const;
  void solve(const RegressionMoments& moments);

  double interval_s_;
  HazardFeatures coefficients_;
  RegressionMoments known_;  ///< with the ridge
};

}  // namespace sila
