#pragma once

#include <Eigen/Core>
#include <iterator>
#include <span>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/model/lessons.hpp"
#include "sila/predict/config.hpp"
#include "sila/predict/outlooks.hpp"
#include "sila/predict/rollout.hpp"

namespace sila {

/// Mean observed speeds that part the classes [m/s]: standing, strolling, slow, normal, fast.
inline constexpr double kSpeedClassLimits_mps[] = {0.3, 0.8, 1.15, 1.5};
static_assert(std::size(kSpeedClassLimits_mps) + 1 == kSpeedClasses);

int speed_class(const CurbTrajectory& observed);

/// Candidate mean velocities from t0 to a step [m/s], one a column.
using Features = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMapFeatures>;
using KinematicFeatures = Eigen::Matrix<double, 2, kKinematicFeatures>;

/// Those of any step.
KinematicFeatures kinematic_features(const CurbTrajectory& observed);

/// What is known of somebody before any roll-out.
struct Observation {
  KinematicFeatures kinematics = KinematicFeatures::Zero();
  Foresight gait;
  std::span<const ExpertOpinion> opinions;
  Foresight outlooks;  ///< all opinions together
  bool known_place = true;
  int speed = 0;  ///< class
};
Observation observation_of(const FieldMap& map, std::span<const int> near, const CurbTrajectory& observed,
                           Scratch& scratch);

/// Candidate mean velocities from t0 to `step` (counted from 0): whatever the place, here, and with a roll-out.
/// Shapes: 2 x kPlaceFreeFeatures, 2 x kAloneFeatures, 2 x kMapFeatures.
Features place_free_features(const Observation& observation, std::size_t step, double interval_s);
Features alone_features(const Observation& observation, const Foresight& outlooks, std::size_t step, double interval_s);
Features map_features(const Observation& observation, const Rollout& rollout, const CurbTrajectory& observed,
                      std::size_t step, double interval_s);

/// The coefficients with which features are summed, per (step, class): solved once from the lessons.
/// Ridge regression towards what the outlooks say (constant velocity where they know nothing).
/// Whatever the place the gait alone counts: coefficients learnt at some places made it worse at others.
/// Source: none in the paper; docs/decisions/0005-blend.md, 0073-gait.md.
class Blend {
 public:
  Blend(const Lessons& lessons, const PredictConfig& config);

  bool taught() const { return steps_ > 0; }
  /// Mean velocity from t0 to `step` [m/s]; steps beyond the lessons use the last of them.
  Vector2 velocity_mps(const Features& features, std::size_t step, int speed_class) const;
  /// Variances [m²] along and across the way to the mean position that so many features give; zero where nothing was
  /// taught, at least those of an error of a millimetre elsewhere.
  Vector2 residual_m2(std::size_t step, int speed_class, Eigen::Index features) const;

 private:
  std::size_t cell(std::size_t step, int speed_class) const;

  int steps_ = 0;
  /// What was taught of one set of features.
  struct Table {
    std::vector<Eigen::VectorXd> coefficients;
    std::vector<Vector2> residuals_m2;
  };
  const Table& table(Eigen::Index features) const;
  Table place_free_, alone_, with_map_;
};

/// A covariance with the given variances along and across a direction.
Matrix2 oriented_covariance(const Vector2& direction, const Vector2& along_across_m2);

}  // namespace sila
