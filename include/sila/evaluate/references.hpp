#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "sila/predict/prediction.hpp"
#include "sila/refine/error_statistics.hpp"

namespace sila {

/// The simple predictors beside which every other one is scored. All begin at the last raw position.
enum class Reference {
  constant_velocity,  ///< mean velocity of the last 0.8 s
  stays,              ///< at the last position
  damped_velocity,    ///< constant velocity, of which each step takes the share that suits the training windows best
  linear,             ///< ridge regression on all observed positions in the heading frame
};
inline constexpr const char* kReferences[] = {"constant_velocity", "stays", "damped_velocity", "linear"};
inline constexpr std::size_t kReferenceCount = std::size(kReferences);

/// A predictor that is linear in the past, with a Gaussian error of its own for each step.
struct LinearReference {
  Reference kind = Reference::constant_velocity;
  Eigen::MatrixXd weights;              ///< (inputs x 2 steps): displacements that are added to constant velocity
  std::vector<double> shares;           ///< of constant velocity, for each step; none: all of it
  std::vector<Matrix2> covariances_m2;  ///< of the error at each step, in the heading frame

  /// The prediction for a path of the past, sampled as those that it was fitted to. Shapes: as many steps as fitted.
  Prediction predict(std::span<const Vector2> past_m, double interval_s) const;
};

/// All references, fitted to windows with their whole future. Without windows errors of a metre a second are assumed,
/// and `linear` is constant velocity. The ridge is the one of the least error over five folds of tracks, and the errors
/// are those of the held-back folds. Shapes: `steps` steps of `interval_s`.
/// Source: Schoeller et al., "What the constant velocity model can teach us about pedestrian motion prediction", 2020,
/// on why such baselines are needed; ridge regression: Hastie, Tibshirani, Friedman, section 3.4.
std::vector<LinearReference> fit_references(std::span<const Window* const> windows, std::size_t steps,
                                            double interval_s);

}  // namespace sila
