#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "sila/model/error_statistics.hpp"
#include "sila/predict/prediction.hpp"

namespace sila {

/// The bin of kScoreBins, from 0; the last one has all scores beyond the last edge.
int score_bin(double nonconformity);

/// The bin of kNoveltyBins of a raw novelty in [0, 1].
int novelty_bin(double raw_novelty);

/// The level of the region of each probability: a quantile of the nonconformity scores of windows that the model had
/// not learnt. A class with few windows is shrunk to the others; without error statistics a Gaussian is assumed.
/// Source: none in the paper; docs/decisions/0071-regions.md.
class Calibration {
 public:
  explicit Calibration(const ErrorStatistics& error_statistics);

  /// Level of the region whose probability is kRegionProbabilities[region]; beyond the last step that of the last.
  double level(std::size_t step, std::size_t score_class, std::size_t region) const;
  /// Share of the people scored so far with a smaller raw novelty; the raw novelty itself until a track was scored.
  double novelty(double raw_novelty) const;

 private:
  int steps_ = 0;
  std::vector<std::array<double, kRegionProbabilities.size()>> levels_;  ///< per cell (step, class)
  std::vector<double> known_better_;                                     ///< share of novelties in lower bins
};

}  // namespace sila
