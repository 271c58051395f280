#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <random>
#include <span>

#include "refine/residual.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/model/error_statistics.hpp"

namespace sila {

/// A vector at each of kCorrectionKnots times ahead, one a column.
using Knots = Eigen::Matrix<double, 2, kCorrectionKnots>;

/// Velocities to add to the mean velocity from t0 to each time [m/s], in the world frame.
struct VelocityCorrection {
  Knots knots_mps = Knots::Zero();
  double knot_interval_s = 1.0;

  Vector2 at(double seconds) const { return interpolated(knots_mps, knot_interval_s, seconds); }
};

/// Random Fourier features (Rahimi and Recht 2007) of the sum of two Gaussian kernels: one with length scale 1, and a
/// wide one, for which few windows suffice. The numbers are the same on every machine, because the learnt coefficients
/// depend on them.
template <int Features, int Inputs>
struct FourierBasis {
  /// Length scale of the wide kernel.
  static constexpr double kWideScale = 4.0;

  Eigen::Matrix<double, Features, Inputs> frequencies;
  Eigen::Matrix<double, Features, 1> phases;
  Eigen::Matrix<double, Features, 1> amplitudes;

  /// The last `wide` features are those of the wide kernel; their amplitude is `amplitude` times that of the others.
  FourierBasis(int wide, double amplitude) {
    std::mt19937_64 engine(1);
    const auto uniform = [&] { return (static_cast<double>(engine() >> 11) + 0.5) * 0x1p-53; };
    for (double& frequency : frequencies.reshaped()) {  // Box and Muller
      const double radius = std::sqrt(-2.0 * std::log(uniform()));
      frequency = radius * std::cos(2.0 * std::numbers::pi * uniform());
    }
    for (double& phase : phases.reshaped()) phase = 2.0 * std::numbers::pi * uniform();
    frequencies.bottomRows(wide) /= kWideScale;
    amplitudes.setConstant(std::sqrt(2.0 / Features));
    amplitudes.tail(wide) *= amplitude;
  }
};

/// The coefficients of a ridge regression; empty without windows. Shape: outputs x features.
Eigen::MatrixXd solve_ridge(const RegressionMoments& moments);
template <int Outputs>
Eigen::Matrix<double, Outputs, Eigen::Dynamic> ridge_coefficients(const RegressionMoments& moments) {
  const Eigen::MatrixXd solved = solve_ridge(moments);
  if (solved.size() == 0) return {};
  return solved;
}

/// The factor of a correction that would have been best so far, in [0, 1] and smaller while few windows are known.
/// `past`: 1 x 1 moments of the regression of errors on earlier corrections. Source: docs/method.md, M6.
double learnt_share(const RegressionMoments& past);

/// Adds a window: `square` of the correction before the window, and its `product` with the errors of the window.
void add_to_share(RegressionMoments& past, double square, double product, double weight);

/// Errors of mean velocities at the knots of a correction [m/s].
struct KnotErrors {
  Knots at_mps;
  /// Weight of the window in the regression: windows with large errors count less.
  double weight = 1.0;
};

/// The errors at the knots, of those at all steps until the horizon. Precondition: not empty.
KnotErrors knot_errors(std::span<const Vector2> errors_mps);

}  // namespace sila
