#pragma once

#include <array>
#include <vector>

#include "sila/live/scores.hpp"

namespace sila {

/// What keeps the nominal regions true: how much their levels are raised, as the logarithm of a factor, for each
/// horizon and probability. Empty: not at all.
struct OnlineCalibration {
  std::vector<double> horizons_s;
  std::vector<std::array<double, kRegionProbabilities.size()>> log_factors;
};

/// The prediction with its regions tuned; between horizons the factors are interpolated. Regions of a higher
/// probability never become smaller than those of a lower one.
Prediction calibrated(Prediction prediction, const OnlineCalibration& online_calibration);

/// One step towards regions that hold as often as nominal: after a pedestrian whose truths were in a region of
/// probability p for a share s of his predictions, its log factor grows by step * (p - s). Summed up, the mean of
/// (p - s) over any T pedestrians is what the log factor moved over step * T, whatever the pedestrians do.
/// Source: Gibbs & Candes 2021, adaptive conformal inference. Differs: docs/decisions/0080-kept-calibration.md.
OnlineCalibration fitted(OnlineCalibration online_calibration, const PersonScore& person,
                         const std::vector<double>& horizons_s, double step);

}  // namespace sila
