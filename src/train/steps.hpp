#pragma once

#include <span>
#include <vector>

#include "sila/model/fusion_problem.hpp"
#include "sila/model/model.hpp"
#include "sila/train/episode.hpp"

namespace sila {

/// The changes by a fusion with this plan. Throws: std::invalid_argument if the plan is not that of these models.
ModelChange change_by(const FusionPlan& plan, const Model& previous, const Model& updated);

/// The changes if a model was learnt again from all data: all previous primitives are gone, all updated ones added.
ModelChange change_by_retraining(const Model& previous, const Model& updated);

/// The change after later steps (pruning, budget) that keep only the updated primitives in `kept` (sorted indices).
ModelChange without_dropped(ModelChange change, const std::vector<int>& kept);

/// Windows of people who have just appeared: of each track one for each of `observed_s`, from its beginning. `present`:
/// as in windows_of. Throws: as windows_of.
std::vector<Window> first_windows_of(std::span<const FramedTrajectory> tracks, const SamplingConfig& sampling,
                                     const RefineConfig& predict, std::span<const double> observed_s,
                                     const PresentPeople& present);

/// The errors of a batch, predicted before it is learnt.
struct BatchErrors {
  std::vector<SiteErrors> sites;
  PrequentialError path;  ///< at all sites that the model knew
};

/// The errors of `previous` on a batch that it has not learnt. At sites that it does not know, the batch is split into
/// parts, and a model of the earlier parts predicts each. `predictor`: that of `previous`; null: it is made here.
/// Source: docs/method.md, section 2.2.
BatchErrors recent_errors(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                          const Predictor* predictor);

/// The error statistics of a model by site.
std::vector<SiteErrors> errors_by_site(const Model& model);

/// Sets the error statistics of each site of a model to its `past` ones, merged with its `recent` ones.
void set_error_statistics(Model& model, const std::vector<SiteErrors>& past, const std::vector<SiteErrors>& recent,
                          double memory_windows);

}  // namespace sila
