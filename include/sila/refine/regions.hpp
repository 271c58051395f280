#pragma once

#include <array>
#include <vector>

#include "sila/model/error_statistics.hpp"
#include "sila/predict/prediction.hpp"

namespace sila {

/// 2 pi times the density of a prediction at a point [1/m²], at least 1e-300, so that its logarithm is finite.
double unnormalised_density(const Prediction& prediction, std::size_t step, const Vector2& point_m);

/// How much less dense the prediction is at a point than at the densest of its modes' centres: log(peak / density), at
/// least 0; half the squared Mahalanobis distance for a single mode. Never infinite.
double nonconformity(const Prediction& prediction, std::size_t step, const Vector2& point_m);

/// Whether a point lies in a nominal region: where the nonconformity score is at most its level.
bool inside(const Prediction& prediction, const Region& region, std::size_t step, const Vector2& point_m);

/// The bin of kScoreBins, from 0; the last one has all scores beyond the last edge.
int score_bin(double nonconformity);

/// The bin of kNoveltyBins of a raw novelty in [0, 1].
int novelty_bin(double raw_novelty);

/// Quantiles of nonconformity scores of windows that the model had not learnt: the level of the region of each
/// probability. A speed class with few windows is pooled with the others; without any window a Gaussian is assumed.
/// Source: none in the paper; docs/decisions/0071-regions.md.
class Calibration {
 public:
  explicit Calibration(const ErrorStatistics& error_statistics);

  bool fitted() const { return steps_ > 0; }
  /// Of the region with this number in kRegionProbabilities.
  double level(std::size_t step, std::size_t score_class, std::size_t region) const;
  /// Share of the people seen so far whose path was better known than this raw novelty; the raw novelty itself while
  /// no track was scored.
  double novelty(double raw_novelty) const;

 private:
  int steps_ = 0;
  std::vector<std::array<double, kRegionProbabilities.size()>> levels_;  ///< per cell (step, class)
  std::vector<double> known_better_;                                     ///< share of novelties in lower bins
};

}  // namespace sila
