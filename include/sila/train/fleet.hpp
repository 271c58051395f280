#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "sila/train/episode.hpp"

namespace sila {

/// Data that one task learns: tracks, `batch` of them an episode, or a model that was learnt elsewhere.
struct Partition {
  std::vector<FramedTrajectory> tracks;
  std::size_t batch = 20;
  std::vector<EpisodeId> left_out;  ///< batches of `tracks` that others have learnt; sorted
  std::optional<Model> model;       ///< instead of tracks
};

/// Its episodes, sorted, each once.
std::vector<EpisodeId> episodes_of(const Partition& partition);

/// A partition that is learnt, and which of its episodes are not.
struct ChosenPartition {
  std::size_t partition = 0;  ///< index
  std::vector<EpisodeId> left_out;
};

/// The site of its first track; of a model, the first.
CurbFrame site_of(const Partition& partition);

/// Partitions in an order that depends on their content alone. Each site's partitions are evenly spread, so that
/// several parts of a fleet know the site. Episodes that are known, or in an earlier partition, are left out, and
/// partitions without any other episode. Shapes: `episodes` has those of each partition, sorted; `sites` a frame for
/// each; `known` is sorted. Throws: std::invalid_argument for shapes that differ.
std::vector<ChosenPartition> choose_partitions(std::span<const std::vector<EpisodeId>> episodes,
                                               std::span<const CurbFrame> sites, const std::vector<EpisodeId>& known);

/// Error statistics by site; the sites have no episodes and no tracks.
struct SiteErrorStatistics {
  std::vector<Site> sites;
};

/// The result of a task of a fleet.
enum class FleetStep {
  learn,      ///< of a partition its model, without error statistics
  fuse,       ///< of two models one
  warm_up,    ///< as calibrate, from a quarter of the windows: then calibrate measures errors of a fitted model
  calibrate,  ///< of a partition, and a model that has not learnt it with earlier error statistics, error statistics
  add,        ///< of two error statistics one
  finalise,   ///< of a model, new error statistics and the start model, the model with all error statistics
};
inline constexpr const char* kFleetSteps[] = {"learn", "fuse", "warm_up", "calibrate", "add", "finalise"};

/// Rounds in which each quarter of the partitions is predicted by a model of the others. The first fits the stacking,
/// the second the corrections of its paths, the third the densities and scores of corrected paths; the last one
/// calibrates, the others warm up.
inline constexpr int kFleetRounds = 3;

/// Inputs are numbers of earlier tasks, or one of these.
inline constexpr int kFleetStart = -1;    ///< the model that the fleet continues
inline constexpr int kFleetNothing = -2;  ///< no model, or no error statistics yet

struct FleetTask {
  FleetStep step = FleetStep::learn;
  int partition = -1;  ///< of learn, warm_up and calibrate
  std::vector<int> inputs = {};
};

/// All tasks; each after those that it needs, the last one makes the model. Partitions are halved recursively and the
/// halves fused. Then a model of three quarters of them predicts the fourth quarter, round by round, and the errors
/// calibrate: no model is scored on tracks that it has learnt. Throws: std::invalid_argument without partitions.
/// Source: none in the paper; docs/decisions/0062-fleet.md.
std::vector<FleetTask> plan_fleet(int partitions, bool goes_on, const EpisodeConfig& config);

using FleetValue = std::variant<std::monostate, Model, SiteErrorStatistics>;

/// Runs one task; a pure function. Only learn, warm_up and calibrate use `partition`.
/// Throws: std::invalid_argument for inputs of another kind, and as run_episode and fuse_models do.
FleetValue run_task(FleetStep step, const Partition& partition, std::span<const FleetValue* const> inputs,
                    const EpisodeConfig& config);

/// The sidewalk width that a fleet of several sites begins with if curb coordinates are scaled by width: the median,
/// the smaller one of two.
/// Throws: std::invalid_argument without widths.
double agreed_width_m(std::vector<double> widths_m);

/// All tasks in this process, one after another; partitions of which all episodes are known change nothing.
/// Where curb coordinates are scaled by width they begin with the agreed one if neither the configuration nor `start`
/// has one.
Model learn_fleet(const Model& start, std::vector<Partition> partitions, EpisodeConfig config);

}  // namespace sila
