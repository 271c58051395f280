#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <utility>

#include "sila/core/trajectory.hpp"
#include "sila/predict/prediction.hpp"
#include "sila/refine/outcomes.hpp"

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

/// Every metric but the coverage, under its name.
inline constexpr std::pair<const char*, double Metrics::*> kMetrics[] = {
    {"weighted_mhd_m", &Metrics::weighted_mhd_m},
    {"most_likely_mhd_m", &Metrics::most_likely_mhd_m},
    {"best_mhd_m", &Metrics::best_mhd_m},
    {"mean_path_mhd_m", &Metrics::mean_path_mhd_m},
    {"mean_path_ade_m", &Metrics::mean_path_ade_m},
    {"mean_path_fde_m", &Metrics::mean_path_fde_m},
    {"ade_m", &Metrics::ade_m},
    {"fde_m", &Metrics::fde_m},
    {"best_ade_m", &Metrics::best_ade_m},
    {"best_fde_m", &Metrics::best_fde_m},
    {"nll", &Metrics::nll},
};

/// The errors over the first `steps` positions. Throws: std::invalid_argument if the truth or a mode is shorter, or
/// for regions of other probabilities than kRegionProbabilities.
Metrics measure(const Prediction& prediction, std::span<const Vector2> truth_m, std::size_t steps);

Metrics operator+(const Metrics& a, const Metrics& b);
Metrics operator*(double factor, const Metrics& a);

/// Modified Hausdorff distance: the larger of the two mean nearest distances [m].
/// Throws: std::invalid_argument if a path is empty.
/// Source: Dubuisson & Jain 1994. It ignores order and time: a reversed path scores 0.
double modified_hausdorff_m(std::span<const Vector2> a, std::span<const Vector2> b);

/// The stated probability that a person changes their motion until a horizon, and whether they did.
struct ChangeForecast {
  double probability = 0.0;
  bool changed = false;
};

/// How stated probabilities of starting (kStanding) or stopping (kWalking) agree with what happened.
struct ChangeScore {
  std::size_t motion_state = 0;
  double horizon_s = 0.0;
  std::size_t windows = 0;
  double rate = 0.0;               ///< share that changed
  double brier = 0.0;              ///< mean squared error of the probabilities (Brier 1950)
  double base_brier = 0.0;         ///< the same of `rate`, which is fitted to these very windows
  double calibration_error = 0.0;  ///< expected, over ten bins of equal width (Naeini et al. 2015)
};

/// Precondition: not empty.
ChangeScore score_changes(std::size_t motion_state, double horizon_s, std::span<const ChangeForecast> forecasts);

/// The stated probabilities of where a person is at a horizon, and where they were.
struct OutcomeForecast {
  OutcomeProbabilities probabilities = {};
  Outcome actual = Outcome::stays;
};

/// How stated probabilities of outcomes of people who stand, or walk, agree with what happened.
struct OutcomeScore {
  std::size_t motion_state = 0;
  double horizon_s = 0.0;
  std::size_t windows = 0;
  OutcomeProbabilities rates = {};   ///< share that had each outcome
  OutcomeProbabilities stated = {};  ///< mean stated probability of each
  double brier = 0.0;                ///< mean over windows of the sum over outcomes of squared errors (Brier 1950)
  double base_brier = 0.0;           ///< the same of `rates`, which are fitted to these very windows
  double calibration_error = 0.0;    ///< expected, over ten bins of equal width, of all outcomes' probabilities
};

/// Precondition: not empty.
OutcomeScore score_outcomes(std::size_t motion_state, double horizon_s, std::span<const OutcomeForecast> forecasts);

}  // namespace sila
