#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "refine/error_density.hpp"
#include "refine/motion_change.hpp"
#include "refine/motion_correction.hpp"
#include "refine/path_correction.hpp"
#include "refine/residual.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/model/error_statistics.hpp"
#include "sila/refine/config.hpp"

namespace sila {

/// The classes of a person; a whole window has `observe_s`. The speed class is 0 for a person who hardly moves, because
/// noisy positions give a standing person a high mean speed.
PersonClass person_class(const CurbTrajectory& observed, double observe_s);

/// Candidate mean velocities from t0 to a step [m/s], one a column.
using Features = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kStackedFeatures>;
/// The column of constant velocity among all features.
inline constexpr int kConstantVelocityFeature = 1;
/// The features that are the same for each step: velocities of the observed path [m/s], world frame.
using KinematicFeatures = Eigen::Matrix<double, 2, kKinematicFeatures>;
KinematicFeatures kinematic_features(const CurbTrajectory& observed);

/// The features of a pedestrian that need no roll-out.
struct ObservedFeatures {
  KinematicFeatures kinematics = KinematicFeatures::Zero();
  VelocityCorrection global_motion;  ///< the error of constant velocity by the motion regression
  std::span<const ExpertPrediction> experts;
  ResidualPrediction residuals;  ///< all experts together
  std::optional<int> site;       ///< none: at an untrained one
  PersonClass person;
  bool fields_nearby = false;  ///< transitions are nearby
  bool uses_residuals = true;  ///< residual GPs; at an untrained site only before errors are known
};

/// Mean velocity from t0 to `seconds` later by the motion regression alone.
Vector2 place_free_mps(const ObservedFeatures& observation, double seconds);
/// Candidate mean velocities from t0 to `seconds` later. Shape: 2 x kStackedFeatures.
Features stacked_features(const ObservedFeatures& observation, const ResidualPrediction& residuals, double seconds);

/// The corrections of the stacked velocities of one person, and the input of the motion correction.
struct Corrections {
  MotionInput input;
  bool apply = false;  ///< the person walks, at a trained site, and transitions are nearby; else all are zero
  VelocityCorrection motion = {};
  VelocityCorrection total = {};  ///< motion correction plus path correction
};

/// The coefficients with which features are summed, per (step, class), and the density of the errors that remain:
/// solved once from the error statistics. Ridge regression towards constant velocity plus 0.8 of the residual. At
/// an untrained site the motion regression alone predicts: coefficients learnt at some sites increased the error at
/// others. Source: none in the paper; docs/decisions/0005-stacking.md, 0073-global_motion.md.
class Stacking {
 public:
  Stacking(const ErrorStatistics& error_statistics, const RefineConfig& config);

  bool fitted() const { return steps_ > 0; }
  /// Length of the whole windows that it was fitted to [s].
  double observe_s() const { return observe_s_; }
  /// The error of constant velocity by the motion regression; zero for people who hardly move.
  VelocityCorrection global_motion(const ObservedFeatures& seen, const CurbTrajectory& observed) const;
  /// Mean velocity from t0 to `step` [m/s]; steps beyond the error statistics use the last of them. For a person who
  /// hardly moves it is the choice that erred least so far: to stay, constant velocity, the stacked prediction, or
  /// halves of them.
  Vector2 velocity_mps(const Features& features, std::size_t step, const ObservedFeatures& seen) const;
  /// The stacked prediction for any class of person. If less was observed, the regression on the features that exist;
  /// it follows from the same sums.
  Vector2 stacked_mps(const Features& features, std::size_t step, const PersonClass& person) const;
  /// The last step that was fitted: the spread of errors must not depend on the requested horizon.
  std::size_t last_step() const { return static_cast<std::size_t>(std::max(steps_, 1) - 1); }
  /// The density of the errors of stacked predictions (`uses_residuals`), or of those of the motion regression alone.
  /// `number`: PersonClass::density().
  const ErrorDensity& density(std::size_t number, bool uses_residuals) const {
    return uses_residuals ? density_[number] : density_place_free_[number];
  }
  /// The corrections of a path. `to_horizon_mps`: the stacked mean velocity until the horizon.
  Corrections corrections(const CurbTrajectory& observed, const ObservedFeatures& seen,
                          const Vector2& to_horizon_mps) const;
  /// Adds a window of a person whose path is corrected. `truths_mps`, `stacked_mps`: true and stacked mean velocities
  /// from t0 to each step.
  void add_window(ErrorStatistics& error_statistics, const CurbTrajectory& observed, const Corrections& known,
                  std::span<const Vector2> truths_mps, std::span<const Vector2> stacked_mps) const;
  /// The hazard of starting for kStanding, of stopping for kWalking.
  const MotionChange& change(std::size_t state) const { return changes_[state]; }

 private:
  int steps_ = 0;
  double observe_s_, horizon_s_;
  std::array<std::vector<Eigen::Matrix<double, kStackedFeatures, 1>>, kObservedClasses> coefficients_;
  std::vector<ErrorDensity> density_, density_place_free_;
  std::array<MotionChange, kMotionStates> changes_;
  std::array<SlowChoice, kSlowClasses> slow_choices_ = {};
  MotionRegression global_motion_;
  MotionCorrection by_motion_;
  PathCorrection by_place_;
};

}  // namespace sila
