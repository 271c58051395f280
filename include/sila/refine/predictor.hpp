#pragma once

#include <memory>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/model/fusion_problem.hpp"
#include "sila/model/model.hpp"
#include "sila/predict/prediction.hpp"
#include "sila/refine/config.hpp"

namespace sila {

class PreparedModel;
struct Snapshot;

/// A model prepared for thousands of predictions; immutable, may be used from many threads; copies are cheap.
/// It keeps copies of the parts that it needs; the model may be destroyed.
class Predictor {
 public:
  /// `config`: `predict` of the EpisodeConfig by which the model was learnt; for a model file
  /// `config_of(stored).episode.predict` (sila/config.hpp). Precondition: `check(model)`, as every model that was read
  /// or learnt passes. Throws: std::invalid_argument for a configuration out of range, and for a longer observe_s than
  /// the model's; NumericalError if a matrix of a GP has no Cholesky factor (a damaged model).
  Predictor(const Model& model, const RefineConfig& config);

  /// The next seconds of a person as weighted modes, at least one for any track. `observe` (sila/core/sampling.hpp)
  /// makes `observed` of a track in metres. Units: `observed` in curb units, sampled at the model's interval, ending at
  /// t0; the prediction in metres, world frame. Throws: std::invalid_argument for a track that breaks its invariant or
  /// has another sampling interval or unit. Source: SILA paper, section on prediction; docs/predict.md.
  Prediction predict(const CurbTrajectory& observed) const;
  /// The same without allocation once the workspace is large enough; the result is valid until the workspace is used
  /// again.
  const Prediction& predict(const CurbTrajectory& observed, Workspace& workspace) const;

  const RefineConfig& config() const;
  /// Time between the steps of a prediction, which is the sampling interval of the model.
  double interval_s() const;

 private:
  friend struct Snapshot;
  friend const PreparedModel& prepared_in(const Predictor& predictor);
  explicit Predictor(std::shared_ptr<const PreparedModel> prepared);

  std::shared_ptr<const PreparedModel> prepared_;
};

/// One prediction; for many tracks make a Predictor. Units and Throws: as there.
Prediction predict(const Model& model, const CurbTrajectory& observed, const RefineConfig& config);

/// A model and its predictor, immutable, so that threads can share them.
struct Snapshot {
  Model model;
  Predictor predictor;

  /// `earlier` saves work: posteriors of GPs that are equal in that model are not factorised again.
  /// Throws: std::invalid_argument for a configuration out of range.
  Snapshot(Model model, const RefineConfig& config, const Snapshot* earlier = nullptr);
};

/// One roll-out of a mode, and the terms of its weight: exp(likelihood_power * log_likelihood + log_prior) *
/// chain_probability, relative to the best.
struct RolloutExplanation {
  double weight = 0.0;  ///< relative to all roll-outs that were kept
  double log_likelihood = 0.0;
  double log_prior = 0.0;
  double chain_probability = 1.0;            ///< product of P(k | j) where it branched
  std::vector<TransitionCount> transitions;  ///< indices of the model
};

/// The roll-outs of a mode.
struct ModeExplanation {
  double weight = 0.0;
  VariantKind variant = VariantKind::expected;
  std::vector<int> primitives;
  std::vector<RolloutExplanation> rollouts;  ///< heaviest first
};

/// The transitions behind a prediction, and the terms of the weights of its roll-outs.
struct Explanation {
  std::vector<ModeExplanation> modes;  ///< in the order of the prediction's
  double likelihood_power = 1.0;
  double effective_samples = 0.0;  ///< effective number of samples of the residual GPs near this person
  double raw_novelty = 0.0;  ///< mean over the scored samples of var / sigma_f^2 of the field that knows each best
  /// Share of the people learnt so far whose path was at least as novel; 1 - raw_novelty before novelties are counted.
  double at_least_as_novel = 0.0;
};

/// Explains `predictor.predict(observed)`. Units and Throws: as there.
Explanation explain(const Predictor& predictor, const CurbTrajectory& observed);

// These throw std::invalid_argument for a step, counted from 0, that the prediction does not have, and for a point that
// is not finite.

/// 2 pi times the density of a prediction at a point [1/m²], at least 1e-300, so that its logarithm is finite.
double unnormalised_density(const Prediction& prediction, std::size_t step, const Vector2& point_m);

/// Nonconformity score of a point [m, world frame]: log(peak / density), where the peak is the largest density at the
/// centre of a mode; at least 0, never infinite. For a single mode half of the squared Mahalanobis distance. Source:
/// docs/method.md, M8.
double nonconformity(const Prediction& prediction, std::size_t step, const Vector2& point_m);

}  // namespace sila
