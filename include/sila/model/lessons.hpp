#pragma once

#include <Eigen/Core>
#include <vector>

namespace sila {

/// Speed classes that lessons are kept for.
inline constexpr int kSpeedClasses = 5;
/// Velocities of the last 0.4, 0.8, 1.6 and 3 s and at the end.
inline constexpr int kKinematicFeatures = 5;
/// The same, and that of the gait: nothing that depends on the place.
inline constexpr int kPlaceFreeFeatures = kKinematicFeatures + 1;
/// The same, and that of the outlooks.
inline constexpr int kAloneFeatures = kPlaceFreeFeatures + 1;
/// The same, and the mean velocities of the two particles of a roll-out.
inline constexpr int kMapFeatures = kAloneFeatures + 2;
/// Bins that surprises and raw novelties are counted in.
inline constexpr int kSurpriseBins = 28;
inline constexpr int kNoveltyBins = 50;

/// Sums over weighted examples from which a linear regression on F features is solved; the size does not grow with the
/// examples.
struct RegressionMoments {
  double weight = 0.0;
  Eigen::MatrixXd features;  ///< F x F, sum of w f f'
  Eigen::VectorXd products;  ///< F, sum of w f y

  RegressionMoments& operator+=(const RegressionMoments& more) {
    weight += more.weight, features += more.features, products += more.products;
    return *this;
  }
};

/// Sums of squared prediction errors in the frame of the person's heading.
struct ResidualMoments {
  double weight = 0.0;
  double along_m2 = 0.0;
  double across_m2 = 0.0;

  ResidualMoments& operator+=(const ResidualMoments& more) {
    weight += more.weight, along_m2 += more.along_m2, across_m2 += more.across_m2;
    return *this;
  }
};

/// What the prediction errors of past episodes taught, gathered on tracks that the model had not learnt yet: how to
/// blend kinematics with roll-outs, and how wide the errors are. Cell (step, speed class) of each table is at step *
/// classes + class.
struct Lessons {
  int steps = 0;
  int classes = 0;
  double interval_s = 0.2;                     ///< between steps
  std::vector<RegressionMoments> with_map;     ///< kinematics and roll-outs
  std::vector<RegressionMoments> without_map;  ///< kinematics and outlooks, for when no transition matches
  std::vector<ResidualMoments> residuals_with_map;
  std::vector<ResidualMoments> residuals_without_map;
  std::vector<ResidualMoments> residuals_place_free;  ///< of the gait alone, for a place that is not known
  std::vector<std::vector<double>> surprises;         ///< how often what happened was so surprising: bins of each cell
  std::vector<double> novelties;                      ///< how often a path was so little known: bins

  bool empty() const { return steps == 0; }
};

/// Throws: std::invalid_argument for tables of another shape than the steps and classes say, numbers that are not
/// finite, weights and sums of squares below 0.
void validate(const Lessons& lessons);

}  // namespace sila
