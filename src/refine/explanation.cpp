#include "predict/rollout.hpp"
#include "refine/prepared_model.hpp"
#include "sila/refine/predictor.hpp"

namespace sila {
namespace {

RolloutExplanation explain_rollout(const FlowFieldIndex& fields, const Rollout& rollout, double total_weight) {
  RolloutExplanation explained{rollout.weight / total_weight,
                               rollout.origin.log_likelihood,
                               rollout.origin.log_prior,
                               rollout.chain_probability,
                               {}};
  for (const int index : rollout.transitions) {
    const FlowFieldIndex::Field& field = fields.field(index);
    explained.transitions.push_back({field.from, field.to, field.count});
  }
  return explained;
}

}  // namespace

Explanation explain(const Predictor& predictor, const CurbTrajectory& observed) {
  const Prediction prediction = predictor.predict(observed);
  Scratch scratch;
  const RolloutSet set =
      prepared_in(predictor).rollouts(observed, static_cast<int>(prediction.times_s.size()), scratch);
  double total = 0.0;
  for (const RolloutGroup group : set.groups) {
    for (const std::size_t member : group) total += set.rollouts[member].weight;
  }
  Explanation explanation;
  explanation.likelihood_power = predictor.config().likelihood_power;
  explanation.effective_samples = prepared_in(predictor).observe(observed, set, scratch).residuals.effective_samples;
  explanation.raw_novelty = set.raw_novelty;
  explanation.at_least_as_novel = 1.0 - prediction.novelty;
  for (const Mode& mode : prediction.modes) {
    ModeExplanation explained{mode.weight, mode.variant, mode.primitives, {}};
    if (!prediction.fallback) {
      for (const std::size_t source : mode.sources) {
        for (const std::size_t member : set.groups[source])
          explained.rollouts.push_back(explain_rollout(prepared_in(predictor).fields(), set.rollouts[member], total));
      }
    }
    explanation.modes.push_back(std::move(explained));
  }
  return explanation;
}

}  // namespace sila
