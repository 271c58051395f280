#pragma once

#include <array>
#include <string>
#include <vector>

#include "sila/io/episode_json.hpp"
#include "sila/service/scores.hpp"

namespace sila {

/// Factors on the levels of the nominal regions, as logarithms, for each horizon and probability. Empty: no change.
struct OnlineCalibration {
  std::vector<double> horizons_s;
  std::vector<std::array<double, kRegionProbabilities.size()>> log_factors;
};

/// The prediction with calibrated regions; factors are interpolated between horizons. A region of a higher probability
/// never becomes smaller than one of a lower probability.
Prediction calibrated(Prediction prediction, const OnlineCalibration& online_calibration);

/// One step towards nominal coverage. If a share s of the predictions of one pedestrian covered the outcome at
/// probability p, the log factor grows by step * (p - s). The mean of (p - s) over any T pedestrians is therefore the
/// change of the log factor over (step * T), whatever the pedestrians do.
/// Source: Gibbs & Candes 2021, adaptive conformal inference. Differs: docs/decisions/0080-kept-calibration.md.
OnlineCalibration fitted(OnlineCalibration online_calibration, const PedestrianScore& pedestrian,
                         const std::vector<double>& horizons_s, double step);

/// What the model file keeps of an episode of a service: the calibration is among the statistics.
EpisodeRecord record_of(int number, const Model& previous, const Episode& episode,
                        const OnlineCalibration& online_calibration);

/// The calibration in the statistics of an episode; empty if there is none or it is invalid.
OnlineCalibration calibration_in(const std::string& statistics);

}  // namespace sila
