#pragma once

#include <nlohmann/json.hpp>

#include "sila/evaluate/evaluate.hpp"

namespace sila {

/// A prediction of a held-back track with what then happened.
struct ScoredPrediction {
  std::size_t track = 0;  ///< index of its track
  Prediction prediction;
  std::vector<Vector2> observed_m;  ///< the raw path until t0
  std::vector<Vector2> truth_m;     ///< what followed, as long as the prediction
  std::vector<Vector2> constant_m;  ///< constant velocity
  Metrics model;                    ///< at the whole horizon
  Metrics constant;
  std::vector<Metrics> horizons;  ///< at each of `horizons_until`
};

/// Predicts every window that has its whole future, `stride_s` apart.
/// Throws: std::invalid_argument for a configuration out of range.
std::vector<ScoredPrediction> score_predictions(const Model& model, std::span<const FramedTrajectory> tracks,
                                                const EpisodeConfig& config, double stride_s);

/// Why a prediction was as wrong as it was, in a few words for people: the first of these that is true: set off,
/// stopped, walked where no track had walked, followed another mode than the most likely one, turned, walked faster,
/// slowed down, or none of these. `interval_s`: between its positions.
std::string reason_of(const ScoredPrediction& scored, double interval_s);

/// Reliability diagrams, one a horizon, none without predictions: `horizon_s`, the `nominal` probabilities of the
/// regions, and the `observed` shares of truths inside them.
nlohmann::ordered_json reliability_json(std::span<const ScoredPrediction> scored, double horizon_s);

}  // namespace sila
