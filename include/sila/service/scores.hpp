#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <vector>

#include "sila/evaluate/evaluate.hpp"
#include "sila/io/reports.hpp"
#include "sila/service/config.hpp"

namespace sila {

/// Sums over scored predictions up to one horizon.
struct HorizonSums {
  std::size_t windows = 0;
  double weighted_mhd_m = 0.0;
  double constant_mhd_m = 0.0;                                   ///< of constant velocity
  std::size_t with_regions = 0;                                  ///< windows whose prediction has nominal regions
  std::array<double, kRegionProbabilities.size()> covered = {};  ///< of those: outcomes inside each region
};
HorizonSums operator+(const HorizonSums& a, const HorizonSums& b);

/// Scores of the predictions of one pedestrian.
struct PedestrianScore {
  std::vector<HorizonSums> all;  ///< at each of `horizons_until`; empty if no prediction was scored
  std::vector<HorizonSums> moving;
  double novelty = 0.0;  ///< sum over `all.front().windows`
};
/// Adds one scored window. Shapes: the same number of horizons each time.
void add(PedestrianScore& score, const WindowScore& window, bool has_regions);

/// Whether the error of the last pedestrians is outside the band of the earlier ones.
struct Drift {
  bool known = false;  ///< enough pedestrians were scored
  bool alarm = false;
  double error_m = 0.0;       ///< mean over the last `drift_pedestrians` that moved: weighted MHD at the whole horizon
  double reference_m = 0.0;   ///< the same over the earlier ones
  double half_width_m = 0.0;  ///< of the band around `reference_m`
};

/// The last pedestrians that have a scored prediction, the newest at the end.
using RecentScores = std::deque<PedestrianScore>;
/// Adds the scores of a pedestrian, unless no prediction was scored; removes the oldest beyond
/// config.scored_pedestrians.
void add(RecentScores& scores, PedestrianScore score, const ServiceConfig& config);

/// Sums over all recent pedestrians at each horizon; empty if there is none.
std::vector<HorizonSums> totals(const RecentScores& scores, bool moving);

/// Coverage of the nominal regions: the share of each pedestrian, averaged over pedestrians, so that a pedestrian who
/// stands for an hour counts once. Shapes: horizons x probabilities; negative where no prediction had regions.
std::vector<std::array<double, kRegionProbabilities.size()>> coverage(const RecentScores& scores);

/// Mean novelty of the scored predictions; 0 for none.
double mean_novelty(const RecentScores& scores);

/// Source: own rule, docs/decisions/0081-drift.md.
Drift drift_of(const RecentScores& scores);

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

/// The record of an episode of a service in the model file: the calibration is among the statistics.
EpisodeRecord record_of(int number, const Model& previous, const Episode& episode,
                        const OnlineCalibration& online_calibration);

/// The calibration in the statistics of the last episode; empty if there is none or it is invalid.
OnlineCalibration calibration_in(const StoredModel& stored);

}  // namespace sila
