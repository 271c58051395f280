#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "sila/train/episode.hpp"

namespace sila {

/// Data that one task learns: tracks, `batch` of them per episode, or a model that was learnt elsewhere.
struct Partition {
  std::vector<FramedTrajectory> tracks;
  std::size_t batch = 20;
  std::vector<EpisodeId> left_out;  ///< batches of `tracks` that others have learnt; sorted
  std::optional<Model> model;       ///< instead of tracks
};

/// The ids of the episodes of a partition, sorted, each once.
std::vector<EpisodeId> episodes_of(const Partition& partition);

/// A partition that is learnt, and the ids of its episodes that are left out.
struct ChosenPartition {
  std::size_t partition = 0;  ///< index
  std::vector<EpisodeId> left_out;
};

/// The frame of the first track of a partition; for a model, that of its first site; the default frame for none.
CurbFrame site_of(const Partition& partition);

/// Partitions in an order that depends on their content alone. Each site's partitions are evenly spread, so that
/// several parts of a fleet know the site. Episodes that are known, in a model, or in an earlier partition, are left
/// out, and partitions without any other episode. Shapes: `episodes` has those of each partition, sorted; `sites` a
/// frame for each, `are_models` whether it is a model; `known` is sorted. Throws: std::invalid_argument for shapes that
/// differ.
std::vector<ChosenPartition> choose_partitions(std::span<const std::vector<EpisodeId>> episodes,
                                               std::span<const CurbFrame> sites, const std::vector<bool>& are_models,
                                               const std::vector<EpisodeId>& known);

struct SiteErrorStatistics {
  std::vector<SiteErrors> sites;
};

/// The kinds of tasks of a fleet: inputs -> result.
enum class FleetStep {
  learn,      ///< partition -> its model, without error statistics
  fuse,       ///< two models -> one
  warm_up,    ///< as calibrate, from a quarter of the windows, so that calibrate measures errors of a fitted model
  calibrate,  ///< partition, model that has not learnt it, earlier error statistics -> error statistics
  add,        ///< two error statistics -> one
  finalise,   ///< model, new error statistics, start model -> the model with all error statistics
};
inline constexpr const char* kFleetSteps[] = {"learn", "fuse", "warm_up", "calibrate", "add", "finalise"};

/// Rounds in which each quarter of the partitions is predicted by a model of the others. The first fits the stacking,
/// the second the corrections of its paths, the third the densities and scores of corrected paths; the last one
/// calibrates, the others warm up.
inline constexpr int kFleetRounds = 3;

/// Inputs are numbers of earlier tasks, or one of these.
inline constexpr int kFleetStart = -1;    ///< the model that the fleet continues
inline constexpr int kFleetNothing = -2;  ///< no model, or no error statistics yet

/// One task of a plan.
struct FleetTask {
  FleetStep step = FleetStep::learn;
  int partition = -1;  ///< of learn, warm_up and calibrate
  std::vector<int> inputs = {};
};

/// All tasks of a run, in an order in which each follows its inputs; the last one makes the model. `goes_on`: the run
/// continues a model. Partitions are halved recursively and the models of the halves fused. Then a model of three
/// quarters of the partitions predicts the fourth quarter, round by round, and its errors become the error statistics:
/// no model is scored on tracks that it has learnt. Throws: std::invalid_argument without partitions.
/// Source: none in the paper; docs/decisions/0062-fleet.md.
std::vector<FleetTask> plan_fleet(int partitions, bool goes_on, const EpisodeConfig& config);

using FleetValue = std::variant<std::monostate, Model, SiteErrorStatistics>;

/// Runs one task; a pure function. Only learn, warm_up and calibrate use `partition`.
/// Throws: std::invalid_argument for inputs of another kind, and as run_episode and fuse_models do.
FleetValue run_task(FleetStep step, const Partition& partition, std::span<const FleetValue* const> inputs,
                    const EpisodeConfig& config);

/// The reference width of several sites if curb coordinates are scaled by width: the median, of two the smaller one.
/// Throws: std::invalid_argument without widths.
double agreed_width_m(std::vector<double> widths_m);

/// Runs all tasks in this process, one after another. Partitions without a new episode change nothing. If curb
/// coordinates are scaled by width and neither the configuration nor `start` has one, it is agreed_width_m. Throws: as
/// run_task.
Model learn_fleet(const Model& start, std::vector<Partition> partitions, EpisodeConfig config);

}  // namespace sila
