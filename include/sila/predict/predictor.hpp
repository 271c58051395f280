#pragma once

#include "sila/model/model.hpp"
#include "sila/predict/blend.hpp"
#include "sila/predict/config.hpp"
#include "sila/predict/field_map.hpp"
#include "sila/predict/prediction.hpp"
#include "sila/predict/regions.hpp"

namespace sila {

/// What is known before modes are made: roll-outs, which of them belong together, and what needs no roll-out.
struct Tracing {
  std::vector<Rollout> rollouts;                 ///< none if no transition matches
  std::vector<std::vector<std::size_t>> groups;  ///< of roll-outs that become one mode, heaviest first
  Observation seen;
  double raw_novelty = 1.0;  ///< how little of the observed path any field knows
};

/// Merged and normalised roll-outs, and the rest of a tracing.
struct Hypotheses {
  std::vector<Rollout> rollouts;
  Observation seen;
  double raw_novelty = 1.0;
};

/// A model made ready to predict thousands of tracks; immutable, may be used from many threads.
class Predictor {
 public:
  /// Throws: std::invalid_argument for a configuration out of range.
  Predictor(const Model& model, const PredictConfig& config);

  /// The next seconds of a person as weighted modes; always an answer.
  /// Units: `observed` in sidewalk widths, sampled at the model's interval, ending at t0; the prediction in metres,
  /// world frame. Throws: std::invalid_argument for a track that breaks its invariant or has another sampling interval.
  /// Source: SILA paper, section on prediction; algorithms 1.11.
  Prediction predict(const CurbTrajectory& observed) const;

  /// Steps towards a prediction, over at least `steps` steps; what lessons are learnt and explanations are made from.
  Tracing trace(const CurbTrajectory& observed, int steps) const;
  Hypotheses hypotheses(const CurbTrajectory& observed, int steps) const;
  Prediction predict(const CurbTrajectory& observed, const Hypotheses& hypotheses) const;

  const PredictConfig& config() const { return config_; }
  double interval_s() const { return interval_s_; }
  const FieldMap& map() const { return map_; }
  const Blend& blend() const { return blend_; }

 private:
  PredictConfig config_;
  double interval_s_;
  FieldMap map_;
  Blend blend_;
  Calibration calibration_;
};

/// One prediction; for many tracks make a Predictor.
Prediction predict(const Model& model, const CurbTrajectory& observed, const PredictConfig& config);

}  // namespace sila
