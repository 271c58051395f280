#pragma once

#include "sila/model/model.hpp"
#include "sila/predict/blend.hpp"
#include "sila/predict/config.hpp"
#include "sila/predict/field_map.hpp"
#include "sila/predict/modes.hpp"
#include "sila/predict/prediction.hpp"
#include "sila/predict/regions.hpp"
#include "sila/predict/scratch.hpp"

namespace sila {

/// What is known before modes are made: roll-outs, which of them belong together, and what needs no roll-out.
/// It and the hypotheses live in the scratch memory that they were made with.
struct Tracing {
  std::span<const Rollout> rollouts;     ///< none if no transition matches
  std::span<const RolloutGroup> groups;  ///< of roll-outs that become one mode, heaviest first
  Observation seen;
  double raw_novelty = 1.0;  ///< how little of the observed path any field knows
};

/// Merged and normalised roll-outs, and the rest of a tracing.
struct Hypotheses {
  std::span<const Rollout> rollouts;
  Observation seen;
  double raw_novelty = 1.0;
};

/// What is kept from one prediction to the next, so that the next need not allocate; one for each thread.
struct Workspace {
  Scratch scratch;
  Prediction prediction;    ///< the last one
  std::vector<Mode> spare;  ///< that it had no need of
};

/// A model made ready to predict thousands of tracks; immutable, may be used from many threads.
class Predictor {
 public:
  /// Throws: std::invalid_argument for a configuration out of range.
  Predictor(const Model& model, const PredictConfig& config);
  /// The same with less work where the model has much of an earlier one, whose predictor is at hand.
  Predictor(const Model& model, const PredictConfig& config, const Model& earlier, const Predictor& of_earlier);

  /// The next seconds of a person as weighted modes; always an answer.
  /// Units: `observed` in sidewalk widths, sampled at the model's interval, ending at t0; the prediction in metres,
  /// world frame. Throws: std::invalid_argument for a track that breaks its invariant or has another sampling interval.
  /// Source: SILA paper, section on prediction; algorithms 1.11.
  Prediction predict(const CurbTrajectory& observed) const;
  /// The same, and once the workspace is as large as it has to be without allocating; valid until it is used again.
  const Prediction& predict(const CurbTrajectory& observed, Workspace& workspace) const;

  /// Steps towards a prediction, over at least `steps` steps; what lessons are learnt and explanations are made from.
  Tracing trace(const CurbTrajectory& observed, int steps, Scratch& scratch) const;
  Hypotheses hypotheses(const CurbTrajectory& observed, int steps, Scratch& scratch) const;
  const Prediction& predict(const CurbTrajectory& observed, const Hypotheses& hypotheses, Workspace& workspace) const;

  const PredictConfig& config() const { return config_; }
  double interval_s() const { return interval_s_; }
  const FieldMap& map() const { return map_; }
  const Blend& blend() const { return blend_; }

 private:
  Predictor(const Model& model, const PredictConfig& config, const FieldMap::Made& earlier);
  void add_regions(Prediction& prediction, int speed_class) const;

  PredictConfig config_;
  double interval_s_;
  FieldMap map_;
  Blend blend_;
  Calibration calibration_;
};

/// One prediction; for many tracks make a Predictor.
Prediction predict(const Model& model, const CurbTrajectory& observed, const PredictConfig& config);

}  // namespace sila
