#pragma once

#include <Eigen/Core>
#include <array>
#include <iterator>
#include <limits>
#include <vector>

#include "sila/model/person_class.hpp"

namespace sila {

/// Mean velocities over seven windows, the velocity at the end, and the direction of walking.
inline constexpr int kKinematicFeatures = 9;
/// The same, the motion regression and the residual GPs.
inline constexpr int kStackedFeatures = kKinematicFeatures + 2;
/// Features of the scale of errors: 1, and logarithms of speeds, changes of velocity and local support.
inline constexpr int kScaleFeatures = 8;
/// Gaussians of the mixture of errors, from narrow to wide.
inline constexpr int kMixtureComponents = 3;
/// What is regressed on the features of the scale: logarithms of errors along and across, and the weight of each
/// component.
inline constexpr int kScaleOutputs = 2 + kMixtureComponents;
/// Bins that nonconformity scores and raw novelties are counted in.
inline constexpr int kScoreBins = 28;
inline constexpr int kNoveltyBins = 50;
/// Features of the hazards of starting and of stopping: of the motion, and of the place (src/refine/motion_change.hpp).
inline constexpr int kHazardMotionFeatures = 15;
inline constexpr int kHazardPlaceFeatures = 30;
inline constexpr int kHazardFeatures = kHazardMotionFeatures + kHazardPlaceFeatures;
/// Features of the regressions of errors by motion and by place, and times ahead at which they are learnt.
inline constexpr int kMotionFeatures = 64;
inline constexpr int kCorrectionFeatures = 150;
inline constexpr int kCorrectionKnots = 5;

/// Sums over weighted examples from which a linear regression of P outputs on F features is solved; the size does not
/// grow with the examples.
struct RegressionMoments {
  double weight = 0.0;
  Eigen::MatrixXd features;  ///< F x F, sum of w f f': the lower triangle, the rest is 0
  Eigen::MatrixXd products;  ///< F x P, sum of w f y'
};

/// Moments of the regression of velocity errors on motion features: along the heading, and to the left of it.
using MotionMoments = std::array<RegressionMoments, 2>;

/// Sums of squared prediction errors along and across the predicted way.
struct ErrorMoments {
  double weight = 0.0;
  double along = 0.0;
  double across = 0.0;
};

/// Sums from which the density of prediction errors is fitted (src/refine/error_density.hpp).
struct DensityMoments {
  /// On kScaleFeatures: logarithms of the mean squared errors along and across, partly relative to the variances of
  /// the component that made them, partly to nominal ones; the probability that each component made them. Means over
  /// the steps.
  RegressionMoments scale;
  /// Expected squared errors of each component, relative to the scale: at step * kMixtureComponents + component.
  std::vector<ErrorMoments> components;
};

/// At observed class * kMotionStates + motion state.
using Densities = std::array<DensityMoments, kErrorDensities>;

/// A prediction for a person who hardly moves: this share of constant velocity plus this share of the stacked
/// prediction. The first choice is to stay.
struct SlowChoice {
  double constant_velocity = 0.0;
  double stacked = 0.0;
};
inline constexpr SlowChoice kSlowChoices[] = {{0.0, 0.0}, {0.5, 0.0}, {1.0, 0.0}, {0.0, 0.5}, {0.0, 1.0}, {0.5, 0.5}};

/// Sums of the displacement errors of each choice, over windows and their steps.
struct SlowErrors {
  double weight = 0.0;
  std::array<double, std::size(kSlowChoices)> errors_m = {};
};

/// Sums of the prediction errors of past episodes, gathered on tracks that the model had not learnt yet: for the
/// stacking of velocities and residual GPs, the density of errors, regions, novelty, motion changes and corrections of
/// paths. Cell (step, speed class) of a table is at step * kSpeedClasses + class.
struct ErrorStatistics {
  int steps = 0;
  double interval_s = 0.2;                  ///< between steps
  double observe_s = 3.2;                   ///< length of a whole window
  std::vector<RegressionMoments> stacking;  ///< regression of true mean velocities on kStackedFeatures
  Densities density;                        ///< errors of stacked predictions
  Densities density_place_free;             ///< errors of the motion regression alone, for untrained sites
  std::vector<std::vector<double>> scores;  ///< counts of nonconformity scores: bins at step * kScoreClasses + class
  std::vector<double> novelties;            ///< counts of raw novelties: bins
  std::vector<SlowErrors> slow;             ///< of each slow class
  /// Hazards of a change of motion state: at kStanding that people start, at kWalking that they stop.
  std::array<RegressionMoments, kMotionStates> changes;
  MotionMoments global_motion;  ///< motion regression: errors of constant velocity on motion, of people who walk
  /// Motion correction: errors of stacked velocities on motion. The share, a 1 x 1 regression, is of these errors on
  /// earlier corrections.
  MotionMoments motion;
  RegressionMoments motion_share;
  /// Path correction: errors that remain after the motion correction, on positions; and its share.
  RegressionMoments correction;
  RegressionMoments correction_share;

  bool empty() const { return steps == 0; }
};

/// Number of windows, of those observed whole, that the densities are fitted to.
double windows_in(const Densities& densities);

/// Tables of zeros.
ErrorStatistics zero_error_statistics(int steps, double interval_s, double observe_s);

/// Sets the sums that depend on positions to zero: those of the path correction, and of the places of hazards.
void forget_positions(ErrorStatistics& error_statistics);

/// The statistics as if every example had counted `share` times; exact, because all of them are sums over examples.
ErrorStatistics discounted(ErrorStatistics error_statistics, double share);

/// The sum of past and recent error statistics; each recent window multiplies past ones by exp(-1 / memory_windows).
/// Unless the memory is infinite (as if one model had gathered both), recent windows count more in the nonconformity
/// scores and in the densities of people who walk. Throws: std::invalid_argument if they differ in shape. Source:
/// docs/decisions/0120-recent-errors-count-more.md.
ErrorStatistics add_error_statistics(const ErrorStatistics& past, const ErrorStatistics& recent,
                                     double memory_windows = std::numeric_limits<double>::infinity());

/// Throws: std::invalid_argument if neither argument is empty and their shapes differ.
void require_like(const ErrorStatistics& a, const ErrorStatistics& b);
/// The same of each pair in a list.
void require_one_shape(const std::vector<ErrorStatistics>& list);

/// Throws: std::invalid_argument for tables whose shape does not follow from the steps and classes, numbers that are
/// not finite, weights and sums of squares below 0.
void validate(const ErrorStatistics& error_statistics);

}  // namespace sila
