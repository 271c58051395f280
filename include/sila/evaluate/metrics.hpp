#pragma once

#include <array>
#include <span>
#include <vector>

#include "sila/predict/prediction.hpp"
#include "sila/refine/regions.hpp"

namespace sila {

/// Errors of one prediction until one horizon, in metres and in the world frame. "MHD" is the modified Hausdorff
/// distance.
struct Metrics {
  double weighted_mhd_m = 0.0;     ///< sum over modes of weight * MHD (the paper's measure)
  double most_likely_mhd_m = 0.0;  ///< of the heaviest mode
  double best_mhd_m = 0.0;         ///< of the best mode
  double mean_path_mhd_m = 0.0;    ///< of the weighted mean path
  double mean_path_ade_m = 0.0;    ///< average displacement of the weighted mean path
  double mean_path_fde_m = 0.0;    ///< its final displacement
  double ade_m = 0.0;              ///< average displacement of the heaviest mode
  double fde_m = 0.0;              ///< final displacement of the heaviest mode
  double best_ade_m = 0.0;         ///< least average displacement over modes
  double best_fde_m = 0.0;
  double nll = 0.0;  ///< -log of the mixture's density [1/m²] at the true position, mean over the steps [nats]
  /// 1 if the true position at the horizon lies in the region of that nominal probability; without nominal regions in
  /// that of the modes taken as Gaussian.
  std::array<double, kRegionProbabilities.size()> coverage = {};
};

/// The modes' mean positions at the first `steps` times, by weight; no mode may be shorter.
std::vector<Vector2> mean_path(const Prediction& prediction, std::size_t steps);

/// `steps` positions of the truth are compared. Throws: std::invalid_argument if the truth or a mode is shorter.
Metrics measure(const Prediction& prediction, std::span<const Vector2> truth_m, std::size_t steps);

Metrics operator+(const Metrics& a, const Metrics& b);
Metrics operator*(double factor, const Metrics& a);

/// -log density of the mixture at one step. Never infinite: densities below 1e-300 count as that.
double negative_log_likelihood(const Prediction& prediction, std::size_t step, const Vector2& truth_m);

}  // namespace sila
