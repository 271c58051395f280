#include "sila/train/fleet.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "core/concatenate.hpp"
#include "core/indices.hpp"
#include "train/steps.hpp"

namespace sila {
namespace {

/// Groups of partitions, each of which a model of the others predicts.
constexpr std::size_t kGroups = 4;

/// The tasks so far, and the number of each fusion and sum by its step and inputs.
struct Plan {
  std::vector<FleetTask> tasks;
  std::map<std::pair<FleetStep, std::vector<int>>, int> combined;
};

int add_task(Plan& plan, FleetTask task) {
  plan.tasks.push_back(std::move(task));
  return static_cast<int>(plan.tasks.size()) - 1;
}

/// The number of a task that combines the results of two others; a task that is already planned is used again.
int combine(Plan& plan, FleetStep step, int first, int second) {
  const auto [known, is_new] = plan.combined.try_emplace({step, {first, second}});
  if (is_new) known->second = add_task(plan, {step, -1, {first, second}});
  return known->second;
}

/// The number of a task that combines all values. They are halved recursively, so that parts of similar size are
/// combined and each takes part in few combinations.
int reduce(Plan& plan, FleetStep step, std::span<const int> values) {
  if (values.empty()) return kFleetNothing;
  if (values.size() == 1) return values.front();
  const std::size_t middle = (values.size() + 1) / 2;
  const int first = reduce(plan, step, values.first(middle));
  const int second = reduce(plan, step, values.subspan(middle));
  return combine(plan, step, first, second);
}

/// A model, fused with the start model if there is one.
int with_start(Plan& plan, bool goes_on, int model) {
  if (!goes_on) return model;
  return model == kFleetNothing ? kFleetStart : combine(plan, FleetStep::fuse, kFleetStart, model);
}

std::vector<int> others(std::span<const int> values, std::size_t left_out) {
  std::vector<int> rest(values.begin(), values.end());
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(left_out));
  return rest;
}

/// Adds the rounds in which a model of the other groups, models[group], predicts each group of partitions, with the
/// error statistics of the others. Returns the number of the task with all error statistics of the last round.
int add_rounds(Plan& plan, std::span<const int> models, std::span<const std::size_t> group_of) {
  std::vector<int> known(models.size(), kFleetNothing), all;
  for (int round = 0; round < kFleetRounds; ++round) {
    const FleetStep step = round + 1 < kFleetRounds ? FleetStep::warm_up : FleetStep::calibrate;
    std::vector<std::vector<int>> fitted(models.size());
    for (std::size_t partition = 0; partition < group_of.size(); ++partition) {
      const std::size_t group = group_of[partition];
      fitted[group].push_back(add_task(plan, {step, static_cast<int>(partition), {models[group], known[group]}}));
    }
    all.clear();
    for (const std::vector<int>& of_group : fitted) all.push_back(reduce(plan, FleetStep::add, of_group));
    if (round + 1 < kFleetRounds)
      for (std::size_t group = 0; group < known.size(); ++group)
        known[group] = reduce(plan, FleetStep::add, others(all, group));
  }
  return reduce(plan, FleetStep::add, all);
}

/// A model or error statistics.
template <class Value>
Value value_in(const FleetValue& value) {
  if (const Value* found = std::get_if<Value>(&value)) return *found;
  if (std::holds_alternative<std::monostate>(value)) return {};
  throw invalid_argument("run_task: an input is a model where error statistics should be, or the other way round");
}

std::vector<double> widths_of(std::span<const Partition> partitions) {
  std::vector<double> widths_m;
  for (const Partition& partition : partitions) {
    if (partition.model)
      widths_m.push_back(partition.model->settings.reference_width_m);
    else if (!partition.tracks.empty())
      widths_m.push_back(partition.tracks.front().frame.sidewalk_width_m);
  }
  return widths_m;
}

using Batches = std::vector<std::span<const FramedTrajectory>>;

Batches batches_of(const Partition& partition) {
  if (partition.batch == 0) throw invalid_argument("partition: batch = 0, must be at least 1");
  const std::span<const FramedTrajectory> tracks = partition.tracks;
  Batches batches;
  for (std::size_t from = 0; from < tracks.size(); from += partition.batch) {
    const auto batch = tracks.subspan(from, std::min(partition.batch, tracks.size() - from));
    if (!std::ranges::binary_search(partition.left_out, episode_id(batch))) batches.push_back(batch);
  }
  return batches;
}

Model learn_batches(Model model, const Partition& partition, const EpisodeConfig& config) {
  for (const auto& batch : batches_of(partition)) model = run_episode(model, batch, config).model;
  return model;
}

Model learn_partition(const Partition& partition, EpisodeConfig config) {
  config.error_statistics.enabled = false;
  Model model = partition.model.value_or(Model{});
  model.refinement.error_statistics.clear();
  return learn_batches(std::move(model), partition, config);
}

/// A model of the partition and a prior alone, learnt batch by batch; each batch is scored before it is learnt.
Model learn_in_turn(const Partition& partition, const ErrorStatistics& prior, EpisodeConfig config) {
  config.error_statistics.memory_windows = std::numeric_limits<double>::infinity();
  Model start;
  start.refinement.prior = prior;
  return learn_batches(std::move(start), partition, config);
}

/// The model with further error statistics, at further sites, too.
Model with_errors(Model model, const std::vector<SiteErrors>& more) {
  for (const SiteErrors& site : more) find_or_add_site(model.sites, site.frame);
  set_error_statistics(model, errors_by_site(model), more, std::numeric_limits<double>::infinity());
  return model;
}

SiteErrorStatistics calibrate(const Partition& partition, Model known, const SiteErrorStatistics& error_statistics,
                              const EpisodeConfig& config) {
  if (partition.model) return {errors_by_site(*partition.model)};
  known = with_errors(std::move(known), error_statistics.sites);
  std::vector<FramedTrajectory> tracks;
  for (const auto& batch : batches_of(partition)) tracks.insert(tracks.end(), batch.begin(), batch.end());
  SiteErrorStatistics fitted{error_statistics_on(known, tracks, config)};
  std::optional<Model> alone;
  for (auto& [frame, statistics] : fitted.sites) {
    if (find_site(known.sites, frame)) continue;
    // A model without tracks of the site has no roll-outs; the partition, learnt batch by batch, has them.
    if (!alone) alone = learn_in_turn(partition, known.refinement.prior, config);
    const auto site = static_cast<std::size_t>(find_site(alone->sites, frame).value());
    statistics = alone->refinement.error_statistics.at(site);
  }
  return fitted;
}

/// Models learnt in parallel are fused once: case 3 fuses the stronger pair, and primitives are weighted by their
/// batches.
FuseConfig fusing(const EpisodeConfig& config) {
  FuseConfig fuse = config.fuse;
  fuse.case_3_fuses_stronger = true;
  fuse.mean = PrimitiveMean::count;
  return fuse;
}

/// Fuses and prunes, as an episode does.
Model fuse_two(const Model& first, const Model& second, const EpisodeConfig& config) {
  const FuseConfig fuse = fusing(config);
  Model fused = fuse_models(first, second, fuse, config.residual).model;
  return prune(std::move(fused), config.prune, fuse, config.residual).model;
}

EpisodeConfig warm_up_config(EpisodeConfig config) {
  constexpr double kStrideFactor = 4.0;
  config.error_statistics.stride_s *= kStrideFactor;
  return config;
}

/// Discounts the earlier error statistics of a site as if its new episodes had come one after another.
Model finalise(Model model, const SiteErrorStatistics& error_statistics, const Model& start,
               const EpisodeConfig& config) {
  set_error_statistics(model, errors_by_site(start), error_statistics.sites, config.error_statistics.memory_windows);
  return apply_budget(std::move(model), config.budget).model;
}

/// The partitions of each site at even distances; those of one site alone stay in their order.
std::vector<ChosenPartition> spread(std::vector<ChosenPartition> partitions, std::span<const CurbFrame> frames) {
  std::vector<Site> sites;
  std::vector<std::size_t> site_of_partition, rank, counts;
  for (const ChosenPartition& partition : partitions) {
    site_of_partition.push_back(static_cast<std::size_t>(find_or_add_site(sites, frames[partition.partition])));
    counts.resize(sites.size());
    rank.push_back(counts[site_of_partition.back()]++);
  }
  std::vector<std::size_t> order = indices(partitions.size());
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {  // (rank + 1/2) / count
    return (2 * rank[a] + 1) * counts[site_of_partition[b]] < (2 * rank[b] + 1) * counts[site_of_partition[a]];
  });
  std::vector<ChosenPartition> result;
  for (const std::size_t i : order) result.push_back(std::move(partitions[i]));
  return result;
}

}  // namespace

std::vector<EpisodeId> episodes_of(const Partition& partition) {
  if (partition.model) return partition.model->episode_ids;
  std::set<EpisodeId> ids;
  for (const auto& batch : batches_of(partition)) ids.insert(episode_id(batch));
  return {ids.begin(), ids.end()};
}

CurbFrame site_of(const Partition& partition) {
  if (partition.model) return partition.model->sites.empty() ? CurbFrame{} : partition.model->sites.front().frame;
  return partition.tracks.empty() ? CurbFrame{} : partition.tracks.front().frame;
}

std::vector<ChosenPartition> choose_partitions(std::span<const std::vector<EpisodeId>> episodes,
                                               std::span<const CurbFrame> sites, const std::vector<bool>& are_models,
                                               const std::vector<EpisodeId>& known) {
  if (sites.size() != episodes.size() || are_models.size() != episodes.size())
    throw invalid_argument("choose_partitions: sites = ", sites.size(), ", are_models = ", are_models.size(),
                           ", must be one for each of ", episodes.size(), " partitions");
  std::vector<std::size_t> order = indices(episodes.size());
  // Models first: what they have in common with tracks can be left out of the tracks alone.
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    return are_models[a] != are_models[b] ? are_models[a] : episodes[a] < episodes[b];
  });
  std::set<EpisodeId> taken(known.begin(), known.end());
  std::vector<ChosenPartition> chosen;
  for (const std::size_t partition : order) {
    ChosenPartition choice{partition, {}};
    std::ranges::copy_if(episodes[partition], std::back_inserter(choice.left_out),
                         [&](const EpisodeId& id) { return taken.contains(id); });
    taken.insert(episodes[partition].begin(), episodes[partition].end());
    if (choice.left_out.size() < episodes[partition].size()) chosen.push_back(std::move(choice));
  }
  return spread(std::move(chosen), sites);
}

std::vector<FleetTask> plan_fleet(int partitions, bool goes_on, const EpisodeConfig& config) {
  if (partitions < 1) throw invalid_argument("plan_fleet: partitions = ", partitions, ", must be at least 1");
  const std::size_t count = static_cast<std::size_t>(partitions), groups = std::min(count, kGroups);
  Plan plan;
  std::vector<std::size_t> group_of;
  std::vector<std::vector<int>> learnt(groups);
  for (std::size_t partition = 0; partition < count; ++partition) {
    group_of.push_back(partition * groups / count);
    learnt[group_of.back()].push_back(add_task(plan, {FleetStep::learn, static_cast<int>(partition), {}}));
  }
  std::vector<int> parts;
  for (const std::vector<int>& group : learnt) parts.push_back(reduce(plan, FleetStep::fuse, group));
  int error_statistics = kFleetNothing;
  if (config.error_statistics.enabled) {
    std::vector<int> models;
    for (std::size_t group = 0; group < groups; ++group)
      models.push_back(with_start(plan, goes_on, reduce(plan, FleetStep::fuse, others(parts, group))));
    error_statistics = add_rounds(plan, models, group_of);
  }
  const int model = with_start(plan, goes_on, reduce(plan, FleetStep::fuse, parts));
  add_task(plan, {FleetStep::finalise, -1, {model, error_statistics, goes_on ? kFleetStart : kFleetNothing}});
  return std::move(plan.tasks);
}

FleetValue run_task(FleetStep step, const Partition& partition, std::span<const FleetValue* const> inputs,
                    const EpisodeConfig& config) {
  const auto input = [&](std::size_t i) -> const FleetValue& {
    if (i >= inputs.size()) throw invalid_argument("run_task: inputs = ", inputs.size(), ", too few");
    return *inputs[i];
  };
  switch (step) {
    case FleetStep::learn:
      return learn_partition(partition, config);
    case FleetStep::fuse:
      return fuse_two(value_in<Model>(input(0)), value_in<Model>(input(1)), config);
    case FleetStep::warm_up:
    case FleetStep::calibrate:
      return calibrate(partition, value_in<Model>(input(0)), value_in<SiteErrorStatistics>(input(1)),
                       step == FleetStep::warm_up ? warm_up_config(config) : config);
    case FleetStep::add:
      return SiteErrorStatistics{
          errors_by_site(with_errors(with_errors({}, value_in<SiteErrorStatistics>(input(0)).sites),
                                     value_in<SiteErrorStatistics>(input(1)).sites))};
    default:
      return finalise(value_in<Model>(input(0)), value_in<SiteErrorStatistics>(input(1)), value_in<Model>(input(2)),
                      config);
  }
}

double agreed_width_m(std::vector<double> widths_m) {
  if (widths_m.empty()) throw invalid_argument("agreed_width_m: widths_m = none, must be at least one");
  std::ranges::sort(widths_m);
  return widths_m[(widths_m.size() - 1) / 2];
}

Model learn_fleet(const Model& start, std::vector<Partition> partitions, EpisodeConfig config) {
  if (partitions.empty()) return start;
  if (config.scaling != CurbScaling::metres && config.reference_width_m == 0.0 && start.episodes == 0)
    config.reference_width_m = agreed_width_m(widths_of(partitions));
  std::vector<std::vector<EpisodeId>> episodes;
  std::vector<CurbFrame> sites;
  std::vector<bool> are_models;
  for (const Partition& partition : partitions) {
    episodes.push_back(episodes_of(partition));
    sites.push_back(site_of(partition));
    are_models.push_back(partition.model.has_value());
  }
  const std::vector<ChosenPartition> chosen = choose_partitions(episodes, sites, are_models, start.episode_ids);
  if (chosen.empty()) return start;
  for (const ChosenPartition& choice : chosen) partitions[choice.partition].left_out = choice.left_out;
  const FleetValue start_value = start, nothing;
  const Partition none;
  std::vector<FleetValue> values;
  const std::vector<FleetTask> plan =
      plan_fleet(static_cast<int>(chosen.size()), start.episodes > 0 || !start.refinement.prior.empty(), config);
  for (const FleetTask& task : plan) {
    std::vector<const FleetValue*> inputs;
    for (const int from : task.inputs)
      inputs.push_back(from == kFleetStart     ? &start_value
                       : from == kFleetNothing ? &nothing
                                               : &values[static_cast<std::size_t>(from)]);
    const Partition& partition =
        task.partition < 0 ? none : partitions[chosen[static_cast<std::size_t>(task.partition)].partition];
    values.push_back(run_task(task.step, partition, inputs, config));
  }
  return std::get<Model>(std::move(values.back()));
}

}  // namespace sila
