#pragma once

#include "sila/model/model.hpp"
#include "sila/predict/blend.hpp"
#include "sila/predict/config.hpp"
#include "sila/predict/field_map.hpp"
#include "sila/predict/prediction.hpp"

namespace sila {

/// Merged and normalised roll-outs, none if no transition matches, and how little of the observed path any field knows.
struct Hypotheses {
  std::vector<Rollout> rollouts;
  double novelty = 1.0;
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

  /// The roll-outs behind a prediction, over at least `steps` steps; what lessons are learnt from.
  Hypotheses hypotheses(const CurbTrajectory& observed, int steps) const;

  const PredictConfig& config() const { return config_; }
  double interval_s() const { return interval_s_; }
  const Blend& blend() const { return blend_; }

 private:
  PredictConfig config_;
  double interval_s_;
  FieldMap map_;
  Blend blend_;
};

/// One prediction; for many tracks make a Predictor.
Prediction predict(const Model& model, const CurbTrajectory& observed, const PredictConfig& config);

}  // namespace sila
