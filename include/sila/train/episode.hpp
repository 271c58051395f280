#pragma once

#include <functional>
#include <span>
#include <vector>

#include "sila/core/companions.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/fuse/fuse.hpp"
#include "sila/learn/learn.hpp"
#include "sila/model/model.hpp"
#include "sila/refine/learning_curve.hpp"
#include "sila/refine/predictor.hpp"
#include "sila/refine/prune.hpp"
#include "sila/train/config.hpp"

namespace sila {

/// A primitive of the updated model that was made from others.
struct FusedPrimitive {
  int primitive = 0;          ///< index in the updated model
  std::vector<int> previous;  ///< of the previous model, sorted
  int incoming = 0;           ///< number of primitives of the increment
};

/// The changes of the primitives by one episode; together, the history of a model.
/// Invariant: the previous primitives that are not in `gone` keep their order, those of the increment follow.
struct ModelChange {
  int primitives_before = 0;
  int primitives_after = 0;
  std::vector<int> gone;   ///< previous primitives that were removed: fused into another one, or split
  std::vector<int> added;  ///< updated primitives that come from the increment alone
  std::vector<FusedPrimitive> fused;
  std::vector<PrimitiveSplit> split;  ///< a previous primitive, and the two updated ones that replace it
  int incoming_split = 0;             ///< primitives of the increment that were replaced by two
};

/// Counts and durations of one episode.
struct EpisodeReport {
  bool known = false;  ///< the model has learnt this batch before: nothing was done
  int tracks = 0;
  std::size_t size_before = 0;
  std::size_t size_after = 0;
  double seconds = 0.0;  ///< wall time of the episode
  LearnReport learn;
  PruneReport prune;
  BudgetReport budget;
  PrequentialError prequential;  ///< of its batch at known sites, before it was learnt
  ModelChange change;
};

struct Episode {
  Model model;
  EpisodeReport report;
};

/// The way a batch is learnt into a model: SILA, or a baseline, all run by the same loop.
/// The batch is in curb coordinates; its settings and `settings` are those of `previous`, or of a new model if
/// `previous` is empty. Of the report it sets `learn`, `prune` and `change`.
using Update = std::function<Episode(const Model& previous, const Batch& batch, const ModelSettings& settings)>;

Update sila_update(const EpisodeConfig& config);  ///< learn, fuse, prune: M(n) = prune(fuse(M(n-1), M'(n)))
/// Learn, then add without fusing. Source: SILA paper, second baseline (standard incremental learning).
Update accumulate_update(const EpisodeConfig& config);
/// Learns anew from all batches so far, which it keeps (batch learning); each call needs the batches in order.
Update retrain_update(const EpisodeConfig& config);

/// The windows of tracks that are observed for predict.observe_s, `stride_s` apart: the observed part until t0, and
/// the future until the track ends. `observed_s`: window i keeps only the last observed_s[i modulo size] seconds
/// before t0, as if the person had appeared then; if it is empty, every window is whole. `present`: the people who may
/// be companions; those of `tracks` if null. Throws: std::invalid_argument for a track that breaks its invariant.
std::vector<Window> windows_of(std::span<const FramedTrajectory> tracks, const SamplingConfig& sampling,
                               const RefineConfig& predict, double stride_s, std::span<const double> observed_s = {},
                               const PresentPeople* present = nullptr);

/// The settings under which a batch at this corner is learnt: the model's, or for an empty model those of the
/// configuration. Throws: std::invalid_argument if the configuration contradicts those of the model, or its error
/// statistics (those of its prior while it has no site).
ModelSettings settings_for(const Model& previous, const CurbFrame& frame, const EpisodeConfig& config);
/// Checks the settings that each use of a model needs. Throws: std::invalid_argument if `scaling` or
/// `sampling.interval_s` is another than that of the model.
void require_same_units(const Model& model, const EpisodeConfig& config);
/// Throws: as settings_for at the first site of the model.
void require_fitting(const Model& model, const EpisodeConfig& config);

/// The error statistics of a model on tracks that it has not learnt, for each site of the tracks. Throws: as
/// settings_for, and for a track that breaks its invariant.
std::vector<SiteErrors> error_statistics_on(const Model& model, std::span<const FramedTrajectory> unseen,
                                            const EpisodeConfig& config);

/// One episode: predict the batch and add the errors to the error statistics, learn the batch, and apply the budget
/// (only if there is one). A batch that the model has learnt before leaves it as it is.
/// Throws: std::invalid_argument for a configuration out of range, for settings other than the model's, for a track
/// that breaks its invariant, and for a budget in which no transition fits. `update`: sila_update if it is empty.
/// `of_previous`: the predictor of `previous` with `config.predict`; null: it is made when needed. Source: SILA paper,
/// Alg. 1. Differs: the error statistics; docs/decisions/0005-stacking.md.
Episode run_episode(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                    const Update& update = {}, const Predictor* of_previous = nullptr);

/// Fuses two finished models, whose tracks are gone: as `fuse`.
/// Throws: std::invalid_argument if their settings or the shape of their error statistics differ, or an episode is
/// in both.
FuseResult fuse_models(const Model& previous, const Model& incoming, const FuseConfig& config,
                       const ResidualConfig& residual = {});

/// The last model and what each episode did.
struct Training {
  Model model;
  std::vector<EpisodeReport> episodes;  ///< of the batches that were learnt
  int known = 0;                        ///< batches that the model had learnt before
};

/// Called after each episode that learnt a batch, with its number (from 1), the model before it, and the episode.
using EpisodeObserver = std::function<void(int, const Model& previous, const Episode&)>;

/// Gives the next batch; an empty one after the last. The tracks must stay valid until the next call.
using BatchSource = std::function<std::span<const FramedTrajectory>()>;

/// Learns batch after batch. SILA and every baseline, files and tracks in memory use this one loop. Throws: as
/// run_episode.
Training run_batches(Model start, const BatchSource& next_batch, const EpisodeConfig& config, const Update& update,
                     const EpisodeObserver& observer = {});

/// The same for tracks in memory, `batch_size` per batch. Throws: std::invalid_argument also if that is 0.
Training run_episodes(const Model& start, std::span<const FramedTrajectory> tracks, std::size_t batch_size,
                      const EpisodeConfig& config, const Update& update, const EpisodeObserver& observer = {});

}  // namespace sila
