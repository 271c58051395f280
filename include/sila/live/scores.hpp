#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <vector>

#include "sila/evaluate/evaluate.hpp"
#include "sila/live/config.hpp"

namespace sila {

/// Sums over judged predictions until one horizon.
struct HorizonSums {
  std::size_t windows = 0;
  double weighted_mhd_m = 0.0;
  double constant_mhd_m = 0.0;
  std::size_t nominal = 0;                                      ///< windows whose prediction nominal regions
  std::array<double, kRegionProbabilities.size()> inside = {};  ///< of those: how many truths were in each region
};
HorizonSums operator+(const HorizonSums& a, const HorizonSums& b);

/// What became of the predictions of one pedestrian.
struct PersonScore {
  std::vector<HorizonSums> all;  ///< at each of `horizons_until`; empty if none was judged
  std::vector<HorizonSums> moving;
  double novelty = 0.0;  ///< sum over `all.front().windows`
};
/// `score` and one judged window more. Shapes: as many horizons each time.
void add(PersonScore& score, const WindowScore& window, bool nominal_regions);

/// Whether the error of the last pedestrians left the band of those before them.
struct Drift {
  bool known = false;  ///< enough pedestrians were judged
  bool alarm = false;
  double error_m = 0.0;       ///< mean over the last `drift_pedestrians` who moved: weighted MHD at the whole horizon
  double reference_m = 0.0;   ///< the same over those before them
  double half_width_m = 0.0;  ///< of the band round `reference_m`
};

/// How well it went lately: the pedestrians remembered, the last at the end. Only who had a judged prediction counts.
using Scoreboard = std::deque<PersonScore>;
void add(Scoreboard& board, PersonScore score, const LiveConfig& config);

/// Sums over all that is remembered, at each horizon; empty if nobody is.
std::vector<HorizonSums> totals(const Scoreboard& board, bool moving);

/// How often the truths were in the nominal regions: shares of each pedestrian, averaged over pedestrians, so that who
/// stands for an hour counts as one. Shapes: horizons x probabilities; negative where nothing was nominal.
std::vector<std::array<double, kRegionProbabilities.size()>> coverage(const Scoreboard& board);

/// Mean novelty of the judged predictions; 0 for none.
double mean_novelty(const Scoreboard& board);

/// Source: own rule, docs/decisions/0081-drift.md.
Drift drift_of(const Scoreboard& board, const LiveConfig& config);

}  // namespace sila
