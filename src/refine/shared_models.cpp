#include <set>

#include "core/concatenate.hpp"
#include "refine/overlap.hpp"
#include "sila/model/packing.hpp"
#include "sila/refine/prune.hpp"

namespace sila {

Model make_prior(std::span<const Model> models) {
  Model prior;
  ErrorStatistics& sum = prior.refinement.prior;
  if (!models.empty()) {
    prior.settings = models.front().settings;
    prior.refinement.residual_settings = models.front().refinement.residual_settings;
  }
  std::set<std::vector<double>> counted;  // models may have begun with the same prior
  std::set<EpisodeId> episodes;
  for (const Model& model : models) {
    for (const EpisodeId& id : model.episode_ids) {
      if (!episodes.insert(id).second)
        throw invalid_argument("prior: two models have learnt episode ", to_text(id),
                               ", which would count twice; leave one of them out");
    }
    if (counted.insert(pack(model.refinement.prior)).second) sum = add_error_statistics(sum, model.refinement.prior);
    for (const ErrorStatistics& statistics : model.refinement.error_statistics)
      sum = add_error_statistics(sum, statistics);
  }
  if (!(windows_in(sum.density) > 0.0))
    throw invalid_argument(
        "prior: the models have no error statistics; learn them with error_statistics.enabled = true, from tracks "
        "longer than predict.observe_s");
  forget_positions(sum);
  return prior;
}

Model k_anonymous(Model model, int min_people) {
  if (min_people < 1) throw invalid_argument("k_anonymous: min_people = ", min_people, ", must be at least 1");
  const auto known = [&](int primitive) {
    return model.primitives[static_cast<std::size_t>(primitive)].support >= min_people;
  };
  std::vector<bool> kept;
  for (const Transition& transition : model.transitions)
    kept.push_back(transition.support >= min_people && known(transition.from) && known(transition.to));
  remove_transitions(model, kept);
  // The sums of the path correction and of the places of hazards depend on positions, also where only one person was.
  for (ErrorStatistics& statistics : model.refinement.error_statistics) forget_positions(statistics);
  return model;
}

}  // namespace sila
