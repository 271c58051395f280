#include "samples.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "sila/predict/constant_velocity.hpp"

namespace sila {
namespace {

/// Samples that agree entirely would have an infinite density; this much nobody can know.
constexpr double kLeastDeviation_m = 0.1, kLeastGrowth_mps = 0.1;
/// How the error of constant velocity is believed to grow.
constexpr double kFallbackSpread_mps = 0.3;

Matrix2 kernel_at(const std::vector<Mode>& paths, std::size_t step, double seconds, double scale) {
  Vector2 mean = Vector2::Zero();
  for (const Mode& mode : paths) mean += mode.weight * mode.path_m[step];
  Matrix2 spread = Matrix2::Zero();
  for (const Mode& mode : paths) {
    const Vector2 off = mode.path_m[step] - mean;
    spread += mode.weight * off * off.transpose();
  }
  const double least_m = kLeastDeviation_m + kLeastGrowth_mps * seconds;
  return scale * spread + least_m * least_m * Matrix2::Identity();
}

}  // namespace

Prediction from_samples(double t0_s, double interval_s, std::vector<Mode> paths) {
  if (paths.empty()) throw std::invalid_argument("from_samples: paths is empty, must have at least one");
  double sum = 0.0, squares = 0.0;
  for (const Mode& mode : paths) sum += mode.weight;
  for (Mode& mode : paths) {
    mode.weight = sum > 0.0 ? mode.weight / sum : 1.0 / static_cast<double>(paths.size());
    squares += mode.weight * mode.weight;
  }
  std::ranges::stable_sort(paths, std::ranges::greater{}, &Mode::weight);
  const double scale = std::pow(squares, 1.0 / 3.0);  // n^(-1 / (d + 4)), squared, of d = 2
  Prediction prediction;
  prediction.t0_s = t0_s;
  for (std::size_t j = 0; j < paths.front().path_m.size(); ++j) {
    prediction.times_s.push_back(static_cast<double>(j + 1) * interval_s);
    const Matrix2 kernel = kernel_at(paths, j, prediction.times_s.back(), scale);
    for (Mode& mode : paths) mode.covariances_m2.push_back(kernel);
  }
  prediction.modes = std::move(paths);
  return prediction;
}

Prediction constant_fallback(const CurbTrajectory& observed, int steps, double interval_s) {
  Prediction prediction;
  prediction.t0_s = observed.times_s.back();
  prediction.fallback = true, prediction.novelty = 1.0;
  Mode mode{1.0, constant_velocity(observed, steps, interval_s), {}, {}};
  for (int j = 1; j <= steps; ++j) {
    const double deviation_m = kLeastDeviation_m + kFallbackSpread_mps * j * interval_s;
    prediction.times_s.push_back(j * interval_s);
    mode.covariances_m2.emplace_back(deviation_m * deviation_m * Matrix2::Identity());
  }
  prediction.modes.push_back(std::move(mode));
  return prediction;
}

}  // namespace sila
