#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "sila/train/episode.hpp"

namespace sila {

/// What is learnt by itself, far from everything else: tracks, `batch` of them an episode, or a model that was made of
/// them somewhere else.
struct Leaf {
  std::vector<FramedTrajectory> tracks;
  std::size_t batch = 20;
  std::vector<EpisodeId> left_out;  ///< batches of `tracks` that others have learnt; sorted
  std::optional<Model> model;       ///< instead of tracks
};

/// Its episodes, sorted, each once.
std::vector<EpisodeId> episodes_of(const Leaf& leaf);

/// Which leaf is taken, and which of its episodes not.
struct ChosenLeaf {
  std::size_t leaf = 0;  ///< index
  std::vector<EpisodeId> left_out;
};

/// The site of its first track; of a model, the first.
CurbFrame site_of(const Leaf& leaf);

/// Leaves in an order that depends on their content alone, whatever order they came in; each site has its leaves evenly
/// spread over it, so that both halves of a fleet know the site. Episodes that are known, or stand in an earlier leaf,
/// are left out, and leaves without any other.
/// Shapes: `episodes` has those of each leaf, sorted; `sites` a frame for each; `known` is sorted.
/// Throws: std::invalid_argument for shapes that differ.
std::vector<ChosenLeaf> choose_leaves(std::span<const std::vector<EpisodeId>> episodes,
                                      std::span<const CurbFrame> sites, const std::vector<EpisodeId>& known);

/// Error statistics by site; the sites have no episodes and no tracks.
struct SiteErrorStatistics {
  std::vector<Site> sites;
};

/// What a task of a fleet makes.
enum class FleetStep {
  learn,    ///< of a leaf its model, without error statistics
  fuse,     ///< of two models one
  warm_up,  ///< as teach, from a quarter of the windows: so that the errors of teach are those of a fitted model
  teach,    ///< of a leaf, and a model that has not learnt it with more error statistics, what its errors teach
  add,      ///< of two error statistics one
  finish,  ///< of a model without new error statistics, those and the model that it began with, the model that has them
};
inline constexpr const char* kFleetSteps[] = {"learn", "fuse", "warm_up", "teach", "add", "finish"};

/// Inputs are numbers of earlier tasks, or one of these.
inline constexpr int kFleetStart = -1;    ///< the model that the fleet goes on with
inline constexpr int kFleetNothing = -2;  ///< no model, or no error statistics yet

struct FleetTask {
  FleetStep step = FleetStep::learn;
  int leaf = -1;  ///< of learn, warm_up and teach
  std::vector<int> inputs = {};
};

/// Everything that is to be done with so many leaves; each task after those that it needs, the last one makes the
/// model. Leaves are halved again and again and the halves fused. Then what one half learnt predicts the other half,
/// round by round, and the errors teach: no model is judged by tracks that it has learnt. Throws: std::invalid_argument
/// without leaves. Source: none in the paper; docs/decisions/0062-fleet.md.
std::vector<FleetTask> plan_fleet(int leaves, bool goes_on, const EpisodeConfig& config);

using FleetValue = std::variant<std::monostate, Model, SiteErrorStatistics>;

/// Does one task; a pure function. `leaf` is looked at by learn, warm_up and teach alone.
/// Throws: std::invalid_argument for inputs of another kind, and as run_episode and fuse_models do.
FleetValue run_task(FleetStep step, const Leaf& leaf, std::span<const FleetValue* const> inputs,
                    const EpisodeConfig& config);

/// The sidewalk width that a fleet of several sites begins with if curb coordinates are scaled by width: the median,
/// the smaller one of two.
/// Throws: std::invalid_argument without widths.
double agreed_width_m(std::vector<double> widths_m);

/// All tasks in this process, one after another; leaves of which everything is known change nothing.
/// Where curb coordinates are scaled by width they begin with the agreed one if neither the configuration nor `start`
/// has one.
Model learn_fleet(const Model& start, std::vector<Leaf> leaves, EpisodeConfig config);

}  // namespace sila
