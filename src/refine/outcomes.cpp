#include "sila/refine/outcomes.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/concatenate.hpp"
#include "core/kinematics.hpp"

namespace sila {
namespace {

constexpr double kTan25 = 0.46630765815499858;  ///< half the width of `straight`
constexpr double kSameTime_s = 1e-9;

/// Points of a standard normal distribution, of equal weight. A sunflower spiral: radii are quantiles, each angle is
/// the golden angle after the one before it.
template <std::size_t kPoints>
std::array<Vector2, kPoints> normal_points() {
  std::array<Vector2, kPoints> points;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double beyond = 1.0 - (static_cast<double>(i) + 0.5) / kPoints;
    const double radius = std::sqrt(-2.0 * std::log(beyond));
    const double angle_rad = static_cast<double>(i) * std::numbers::pi * (3.0 - std::sqrt(5.0));
    points[i] = {radius * std::cos(angle_rad), radius * std::sin(angle_rad)};
  }
  return points;
}

/// Positions in the frame of the heading: x ahead, y to the left.
Outcome outcome_at(double x, double y, double tan_straight) {
  if (x * x + y * y <= kStandingReach_m * kStandingReach_m) return Outcome::stays;
  if (std::abs(y) <= tan_straight * x) return Outcome::straight;
  if (std::abs(y) <= -x) return Outcome::back;
  return y > 0.0 ? Outcome::left : Outcome::right;
}

double tan_straight_of(const Prediction& prediction) {
  return prediction.standing ? 1.0 : kTan25;
}

/// Into the frame of the heading: the rows are the heading and the direction to the left of it, seen from above.
Matrix2 to_heading(const Prediction& prediction) {
  Matrix2 axes = axes_along(prediction.heading);
  if (prediction.mirrored) axes.col(1) *= -1.0;
  return axes.transpose();
}

/// The Cholesky factor of a covariance in other axes.
Matrix2 factor_in(const Matrix2& axes, const Matrix2& covariance) {
  const Matrix2 turned = axes * covariance * axes.transpose();
  return turned.llt().matrixL();
}

void require_heading(const Prediction& prediction, const char* function) {
  if (prediction.heading.isZero()) throw invalid_argument(function, ": heading = 0, the prediction does not know it");
}

/// Sets the probability of `stays` and scales the others to the sum 1; they become equal if all were 0.
void set_stays(OutcomeProbabilities& probabilities, double stays) {
  const double moved = 1.0 - probabilities.front(), wanted = 1.0 - stays;
  for (std::size_t k = 1; k < kOutcomeCount; ++k)
    probabilities[k] = moved > 1e-9 ? probabilities[k] * wanted / moved : wanted / (kOutcomeCount - 1);
  probabilities.front() = stays;
}

}  // namespace

Outcome outcome_of(const Prediction& prediction, const Vector2& position_m) {
  require_heading(prediction, "outcome_of");
  if (!position_m.allFinite())
    throw invalid_argument("outcome_of: position_m = (", position_m.x(), ", ", position_m.y(), "), must be finite");
  const Vector2 relative_m = to_heading(prediction) * (position_m - prediction.start_m);
  return outcome_at(relative_m.x(), relative_m.y(), tan_straight_of(prediction));
}

OutcomeProbabilities outcome_probabilities(const Prediction& prediction, std::size_t step) {
  if (step >= prediction.times_s.size())
    throw invalid_argument("outcome_probabilities: step = ", step, ", the prediction has ", prediction.times_s.size());
  require_heading(prediction, "outcome_probabilities");
  static const auto points = normal_points<256>();
  const Matrix2 rotation = to_heading(prediction);
  const double tan_straight = tan_straight_of(prediction);
  OutcomeProbabilities probabilities = {};
  for (const Mode& mode : prediction.modes) {
    const Vector2 mean_m = rotation * (mode.path_m[step] - prediction.start_m);
    const Matrix2 factor = factor_in(rotation, mode.covariances_m2[step]);
    std::array<int, kOutcomeCount> counts = {};
    for (const Vector2& u : points) {
      const Vector2 point_m = mean_m + factor * u;
      ++counts[static_cast<std::size_t>(outcome_at(point_m.x(), point_m.y(), tan_straight))];
    }
    for (std::size_t k = 0; k < kOutcomeCount; ++k)
      probabilities[k] += mode.weight * counts[k] / static_cast<double>(points.size());
  }
  if (prediction.standing && !prediction.change_probabilities.empty())
    set_stays(probabilities, 1.0 - prediction.change_probabilities[step]);
  return probabilities;
}

std::vector<double> nearest_probabilities(const Prediction& prediction) {
  static const auto points = normal_points<64>();
  const std::vector<Mode>& modes = prediction.modes;
  std::vector<double> probabilities(modes.size(), 0.0);
  if (prediction.times_s.empty()) return probabilities;
  const std::size_t last = prediction.times_s.size() - 1, middle = last / 2;
  // Points in the axes of the heading make the error the same in any axes of the world.
  const Matrix2 rotation = prediction.heading.isZero() ? Matrix2::Identity() : to_heading(prediction);
  for (const Mode& mode : modes) {
    const Matrix2 to_middle = rotation.transpose() * factor_in(rotation, mode.covariances_m2[middle]);
    const Matrix2 to_last = rotation.transpose() * factor_in(rotation, mode.covariances_m2[last]);
    for (const Vector2& u : points) {
      const Vector2 at_middle_m = mode.path_m[middle] + to_middle * u, at_last_m = mode.path_m[last] + to_last * u;
      std::size_t nearest = 0;
      double least_m = HUGE_VAL;
      for (std::size_t k = 0; k < modes.size(); ++k) {
        const double off_m =
            (modes[k].path_m[middle] - at_middle_m).norm() + (modes[k].path_m[last] - at_last_m).norm();
        if (off_m < least_m) {
          least_m = off_m;
          nearest = k;
        }
      }
      probabilities[nearest] += mode.weight / static_cast<double>(points.size());
    }
  }
  return probabilities;
}

std::vector<std::size_t> outcome_steps(const Prediction& prediction) {
  std::vector<std::size_t> steps;
  const std::vector<double>& times_s = prediction.times_s;
  for (double due_s = 1.0; !times_s.empty() && due_s < times_s.back() - kSameTime_s; due_s += 1.0) {
    const auto after = std::ranges::upper_bound(times_s, due_s + kSameTime_s);
    const auto count = static_cast<std::size_t>(after - times_s.begin());
    if (count > 0 && (steps.empty() || steps.back() != count - 1)) steps.push_back(count - 1);
  }
  if (!times_s.empty()) steps.push_back(times_s.size() - 1);
  return steps;
}

}  // namespace sila
