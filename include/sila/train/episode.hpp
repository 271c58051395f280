#pragma once

#include <functional>
#include <span>
#include <vector>

#include "sila/core/framed_trajectory.hpp"
#include "sila/fuse/fuse.hpp"
#include "sila/learn/learn.hpp"
#include "sila/refine/compact.hpp"
#include "sila/refine/error_statistics.hpp"
#include "sila/refine/limit.hpp"
#include "sila/refine/refine.hpp"
#include "sila/train/change.hpp"
#include "sila/train/config.hpp"

namespace sila {

/// What one episode did.
struct EpisodeReport {
  bool known = false;  ///< the model has learnt this batch before: nothing was done
  int tracks = 0;
  std::size_t size_before = 0;
  std::size_t size_after = 0;
  double seconds = 0.0;  ///< wall time of the episode
  LearnReport learn;
  FuseReport fuse;
  CompactReport compact;
  LimitReport given_up;
  ModelChange change;
};

struct Episode {
  Model model;
  EpisodeReport report;
};

/// What an update makes of the model and a batch.
struct Updated {
  Model model;
  LearnReport learn;
  FuseReport fuse;
  CompactReport compact;
  ModelChange change;
};

/// How a model takes up a batch: SILA or one of the baselines that it is compared with, in the same loop.
/// The batch comes in curb coordinates; `settings` are those of the model, or the first ones.
using Update = std::function<Updated(const Model& previous, const Batch& batch, const ModelSettings& settings)>;

Update sila_update(const EpisodeConfig& config);  ///< learn, fuse, compact: M(n) = compact(fuse(M(n-1), M'(n)))
Update accumulate_update(
    const EpisodeConfig& config);  ///< learn, then add without fusing (standard incremental learning)
/// Learns anew from all batches so far, which it keeps (batch learning); each call needs the batches in order.
Update retrain_update(const EpisodeConfig& config);

/// The windows of tracks that can be predicted: what was seen until a prediction is due, and what came after, as far as
/// the track goes.
std::vector<Window> windows_of(std::span<const FramedTrajectory> tracks, const SamplingConfig& sampling,
                               const PredictConfig& predict, double every_s);

/// The conventions under which a batch at this corner is learnt: the model's, or the first ones.
/// Throws: std::invalid_argument if the configuration contradicts those of the model.
ModelSettings settings_for(const Model& previous, const CurbFrame& frame, const EpisodeConfig& config);

/// What the errors of a model teach on tracks that it has not learnt: for each of their sites its error statistics, and
/// no episodes or tracks. `ready`, if it is at hand: what predicts by this very model with config.predict.
std::vector<Site> error_statistics_on(const Model& model, std::span<const FramedTrajectory> unseen,
                                      const EpisodeConfig& config, const Predictor* ready = nullptr);

/// One episode: forget a little (only with a half-life, and only of the sites of the batch), predict the batch with
/// what is known so far and learn from the errors, learn the batch itself, and give up what is over the limits (only if
/// there are any). A batch that the model has learnt before leaves it as it is. Throws: std::invalid_argument for a
/// configuration out of range or conventions other than the model's, limits in which nothing fits. `ready`, if it is at
/// hand: what predicts by `previous` with config.predict. Source: SILA paper, Alg. 1. Differs: the error statistics;
/// docs/decisions/0005-stacking.md.
Episode run_episode(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                    const Update& update, const Predictor* ready = nullptr);

/// The same with SILA's update.
Episode run_episode(const Model& previous, std::span<const FramedTrajectory> batch, const EpisodeConfig& config,
                    const Predictor* ready = nullptr);

/// Fuses two finished models, whose tracks are gone: as `fuse`.
/// Throws: std::invalid_argument if their conventions or the shape of their error statistics differ, or an episode is
/// in both.
Fused fuse_models(const Model& previous, const Model& incoming, const FuseConfig& config,
                  const ResidualConfig& residual = {});

}  // namespace sila
