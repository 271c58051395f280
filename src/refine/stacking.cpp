#include "refine/stacking.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "core/kinematics.hpp"
#include "model/parts.hpp"

namespace sila {
namespace {

/// Ridge towards the residual GPs (without them: constant velocity), for all people who walk together. Examples are
/// weighted by their precision [s^2/m^2].
constexpr double kRidge = 30.0;
/// After this number of windows, from one or two people, the ridge is twice as strong as after many.
constexpr double kFewWindows = 20.0;
/// Prior coefficient of the prediction by residual GPs, beside constant velocity: the windows of one person are not
/// independent, so residual GPs of a few people know less than their variances say.
constexpr double kResidualShare = 0.8;
/// Ridge of each speed class towards the coefficients of all people who walk. The velocities of people who stand are
/// small, so a ridge as strong would leave them the coefficients of walkers.
constexpr double kClassRidge = 1000.0, kStandingRidge = 50.0;
/// Speed of the feature that only has a direction [m/s]: how much pedestrians slow down or speed up on average.
constexpr double kHeading_mps = 0.3;

constexpr double kVelocityWindows_s[] = {0.4, 0.8, 1.6, 3.0, 0.2, 1.2, 2.4};
constexpr Eigen::Index kEndFeature = std::size(kVelocityWindows_s), kHeadingFeature = kEndFeature + 1;
static_assert(kHeadingFeature + 1 == kKinematicFeatures);
constexpr Eigen::Index kGlobalMotionFeature = kKinematicFeatures, kResidualFeature = kGlobalMotionFeature + 1;
static_assert(kVelocityWindows_s[kConstantVelocityFeature] == kConstantVelocityWindow_s);

using Coefficients = Eigen::Matrix<double, kStackedFeatures, 1>;

/// Whether a feature needs more than was observed.
bool missing(Eigen::Index feature, std::size_t observed_class) {
  return observed_class > 0 && feature < kEndFeature &&
         kVelocityWindows_s[feature] > kShorterObserved_s[observed_class - 1];
}

/// Ridge regression towards `prior` on the features that there are; the examples are weighted by the inverse of their
/// variance.
Coefficients solve(const RegressionMoments& moments, std::size_t observed_class, double ridge,
                   const Coefficients& prior) {
  if (moments.weight <= 0.0) return prior;
  Eigen::Matrix<double, kStackedFeatures, kStackedFeatures> matrix = moments.features;
  Coefficients products = moments.products;
  for (Eigen::Index i = 0; i < kStackedFeatures; ++i) {
    if (!missing(i, observed_class)) continue;
    matrix.row(i).setZero();
    matrix.col(i).setZero();
    products(i) = 0.0;
  }
  matrix.diagonal().array() += ridge;
  const Coefficients coefficients = matrix.ldlt().solve(products + ridge * prior);
  return coefficients.allFinite() ? coefficients : prior;
}

/// The coefficients of each cell. First those of all people who walk together, towards the residual GPs: the small
/// errors of people who stand would outweigh all others. Then those of each class towards these.
std::vector<Coefficients> solve(const ErrorStatistics& error_statistics, std::size_t observed_class) {
  const Eigen::Index constant = missing(kConstantVelocityFeature, observed_class) ? 0 : kConstantVelocityFeature;
  const Coefficients prior =
      kResidualShare * Coefficients::Unit(kResidualFeature) + (1.0 - kResidualShare) * Coefficients::Unit(constant);
  const double windows = std::max(1.0, error_statistics.density[kWalking].scale.weight);
  const double ridge = kRidge * (1.0 + square(kFewWindows / windows));
  std::vector<Coefficients> solved;
  for (auto of_step = error_statistics.stacking.begin(); of_step != error_statistics.stacking.end();
       of_step += kSpeedClasses) {
    RegressionMoments walking = of_step[1];
    for (int speed = 2; speed < kSpeedClasses; ++speed) add_sums(walking, of_step[speed]);
    const Coefficients of_walking = solve(walking, observed_class, ridge, prior);
    for (int speed = 0; speed < kSpeedClasses; ++speed) {
      const double class_ridge = motion_state(speed) == kStanding ? kStandingRidge : kClassRidge;
      solved.push_back(solve(of_step[speed], observed_class, class_ridge, of_walking));
    }
  }
  return solved;
}

/// Below this number of windows each slow class has a fixed choice: to stay, constant velocity at half the speed, and
/// the stacked prediction for people who have stopped.
constexpr double kLeastSlowWindows = 10.0;
constexpr std::array<SlowChoice, kSlowClasses> kUnfittedSlowChoices = {{{0.0, 0.0}, {0.5, 0.0}, {0.0, 1.0}}};

std::array<SlowChoice, kSlowClasses> choices_of(const ErrorStatistics& error_statistics) {
  std::array<SlowChoice, kSlowClasses> choices = kUnfittedSlowChoices;
  for (std::size_t c = 0; c < error_statistics.slow.size(); ++c) {
    const SlowErrors& slow = error_statistics.slow[c];
    if (slow.weight < kLeastSlowWindows) continue;
    choices[c] = kSlowChoices[std::ranges::min_element(slow.errors_m) - slow.errors_m.begin()];
  }
  return choices;
}

std::vector<ErrorDensity> densities_of(const Densities& moments, const ErrorStatistics& shape) {
  std::vector<ErrorDensity> densities;
  for (std::size_t d = 0; d < kErrorDensities; ++d)
    densities.emplace_back(moments[d], shape.steps, shape.interval_s, d % kMotionStates);
  return densities;
}

/// A person whose observed positions lie further from their mean than this (root mean square) [m] does not stand, even
/// if they end where they began: the person walked there and back.
constexpr double kStandingSpread_m = 0.25;

double spread_m(const CurbTrajectory& observed) {
  Vector2 mean = Vector2::Zero();
  for (const Vector2& position : observed.positions) mean += position;
  mean /= static_cast<double>(observed.positions.size());
  double sum_m2 = 0.0;
  for (const Vector2& position : observed.positions)
    sum_m2 += velocity_to_world(observed.frame, position - mean).squaredNorm();
  return std::sqrt(sum_m2 / static_cast<double>(observed.positions.size()));
}

/// None if the person walks, or if fewer than two samples were observed.
std::optional<std::size_t> slow_class(const CurbTrajectory& observed) {
  if (observed.positions.size() < 2) return std::nullopt;
  const Vector2 way = velocity_to_world(observed.frame, observed.positions.back() - observed.positions.front());
  const double net_mps = way.norm() / (observed.times_s.back() - observed.times_s.front());
  const auto limit = std::ranges::upper_bound(kSlowLimits_mps, net_mps);
  if (limit != std::end(kSlowLimits_mps) && spread_m(observed) <= kStandingSpread_m)
    return static_cast<std::size_t>(limit - std::begin(kSlowLimits_mps));
  const double now_mps = mean_velocity_mps(observed, kConstantVelocityWindow_s).norm();
  if (now_mps < *std::rbegin(kSlowLimits_mps)) return kStopped;
  return std::nullopt;
}

/// The class of kShorterObserved_s, 0 for a whole window of `observe_s`.
std::size_t observed_class(const CurbTrajectory& observed, double observe_s) {
  constexpr double slack_s = 1e-3;
  const std::size_t samples = observed.times_s.size();
  const double seconds = observed.times_s.back() - observed.times_s.front();
  if (samples < 2) return kObservedClasses - 1;
  const double interval_s = seconds / static_cast<double>(samples - 1);
  // A whole window reaches back less than observe_s, by less than one interval.
  if (seconds + interval_s + slack_s > std::floor(observe_s / interval_s + slack_s) * interval_s) return 0;
  const auto shorter =
      std::ranges::find_if(kShorterObserved_s, [&](double least_s) { return seconds + slack_s >= least_s; });
  return std::min(kObservedClasses - 1, static_cast<std::size_t>(shorter - std::begin(kShorterObserved_s)) + 1);
}

}  // namespace

PersonClass person_class(const CurbTrajectory& observed, double observe_s) {
  PersonClass person{0, slow_class(observed), observed_class(observed, observe_s)};
  if (person.hardly_moved()) return person;
  const double mean_mps = mean_speed_mps(observed);
  for (double limit_mps : kSpeedClassLimits_mps) person.speed += mean_mps >= limit_mps ? 1 : 0;
  return person;
}

KinematicFeatures kinematic_features(const CurbTrajectory& observed) {
  KinematicFeatures features;
  Eigen::Index column = 0;
  for (double window_s : kVelocityWindows_s) features.col(column++) = mean_velocity_mps(observed, window_s);
  features.col(kEndFeature) = velocity_to_world(observed.frame, observed.velocities.back());
  const Vector2 constant = features.col(kConstantVelocityFeature);
  features.col(kHeadingFeature) = kHeading_mps * constant / std::max(0.1, constant.norm());
  return features;
}

Vector2 place_free_mps(const ObservedFeatures& observation, double seconds) {
  return observation.kinematics.col(kConstantVelocityFeature) + observation.global_motion.at(seconds);
}

Features stacked_features(const ObservedFeatures& observation, const ResidualPrediction& residuals, double seconds) {
  Features features(2, kStackedFeatures);
  const Vector2 constant = observation.kinematics.col(kConstantVelocityFeature);
  features.leftCols(kKinematicFeatures) = observation.kinematics;
  features.col(kGlobalMotionFeature) = place_free_mps(observation, seconds);
  features.col(kResidualFeature) = constant + residuals.residual_mps(seconds);
  return features;
}

Stacking::Stacking(const ErrorStatistics& error_statistics, const RefineConfig& config)
    : steps_(config.stacking ? error_statistics.steps : 0),
      observe_s_(error_statistics.empty() ? config.observe_s : error_statistics.observe_s),
      horizon_s_(error_statistics.steps * error_statistics.interval_s),
      density_(densities_of(error_statistics.density, error_statistics)),
      density_place_free_(densities_of(error_statistics.density_place_free, error_statistics)),
      changes_{MotionChange(error_statistics.changes[kWalking], kWalking, error_statistics.interval_s),
               MotionChange(error_statistics.changes[kStanding], kStanding, error_statistics.interval_s)},
      global_motion_(config.stacking ? error_statistics.global_motion : MotionMoments{}),
      by_motion_(error_statistics),
      by_place_(error_statistics) {
  if (steps_ == 0) return;
  slow_choices_ = choices_of(error_statistics);
  for (std::size_t observed = 0; observed < kObservedClasses; ++observed)
    coefficients_[observed] = solve(error_statistics, observed);
}

Vector2 Stacking::velocity_mps(const Features& features, std::size_t step, const ObservedFeatures& seen) const {
  const Vector2 stacked = stacked_mps(features, step, seen.person);
  if (!seen.person.slow || !fitted()) return stacked;
  const SlowChoice& choice = slow_choices_[*seen.person.slow];
  return choice.constant_velocity * features.col(kConstantVelocityFeature) + choice.stacked * stacked;
}

VelocityCorrection Stacking::global_motion(const ObservedFeatures& seen, const CurbTrajectory& observed) const {
  if (!seen.person.walks()) return {};
  return global_motion_.error(motion_input(seen.kinematics.leftCols<4>(), observed.companions_mps), horizon_s_);
}

Corrections Stacking::corrections(const CurbTrajectory& observed, const ObservedFeatures& seen,
                                  const Vector2& to_horizon_mps) const {
  Corrections found{change_input(seen.kinematics.leftCols<4>(), to_horizon_mps, observed.companions_mps)};
  found.apply = fitted() && seen.site && seen.fields_nearby && seen.person.error_state() == kWalking;
  if (!found.apply) return found;
  found.motion = by_motion_.correction(found.input, horizon_s_);
  found.total = by_place_.correction(observed, to_horizon_mps + found.motion.at(horizon_s_), horizon_s_);
  found.total.knots_mps += found.motion.knots_mps;
  return found;
}

void Stacking::add_window(ErrorStatistics& error_statistics, const CurbTrajectory& observed, const Corrections& known,
                          std::span<const Vector2> truths_mps, std::span<const Vector2> stacked_mps) const {
  const std::size_t steps = truths_mps.size();
  std::vector<Vector2> errors_mps, left_mps;  // of stacking, and what the correction by motion leaves of them
  for (std::size_t j = 0; j < steps; ++j) {
    errors_mps.push_back(truths_mps[j] - stacked_mps[j]);
    left_mps.push_back(errors_mps[j] - known.motion.at(static_cast<double>(j + 1) * error_statistics.interval_s));
  }
  by_motion_.add_window(error_statistics, known.input, errors_mps);
  by_place_.add_window(error_statistics, observed, left_mps, truths_mps.back() - left_mps.back());
}

Vector2 Stacking::stacked_mps(const Features& features, std::size_t step, const PersonClass& person) const {
  if (steps_ == 0) return features.col(kResidualFeature);
  const std::size_t cell = std::min(step, last_step()) * kSpeedClasses + static_cast<std::size_t>(person.speed);
  return features.lazyProduct(coefficients_[person.observed][cell]);
}

}  // namespace sila
