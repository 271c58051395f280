#include "sila/episode/fleet.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

namespace sila {
namespace {

using Plan = std::vector<FleetTask>;
using Inputs = std::span<const FleetValue* const>;

int add_task(Plan& plan, FleetTask task) {
  plan.push_back(std::move(task));
  return static_cast<int>(plan.size()) - 1;
}

/// Halves again and again: near-equal parts meet, and nothing is changed more often than it must be.
int reduce(Plan& plan, FleetStep step, std::span<const int> values) {
  if (values.empty()) return kFleetNothing;
  if (values.size() == 1) return values.front();
  const std::size_t middle = (values.size() + 1) / 2;
  const int first = reduce(plan, step, values.first(middle));
  const int second = reduce(plan, step, values.subspan(middle));
  if (second == kFleetNothing) return first;
  return add_task(plan, {step, -1, {first, second}});
}

/// A half, and what was known before.
int with_start(Plan& plan, bool goes_on, int half) {
  if (!goes_on) return half;
  return half == kFleetNothing ? kFleetStart : add_task(plan, {FleetStep::fuse, -1, {kFleetStart, half}});
}

/// Adds the rounds in which each half is predicted by the other one; gives what all errors of the last round teach.
int add_rounds(Plan& plan, const int (&judges)[2], int leaves, int middle, int rounds) {
  int lessons[2] = {kFleetNothing, kFleetNothing};
  for (int round = 0; round < rounds; ++round) {
    const FleetStep step = round + 1 < rounds ? FleetStep::rehearse : FleetStep::teach;
    std::vector<int> taught[2];
    for (int leaf = 0; leaf < leaves; ++leaf) {
      const int half = leaf < middle ? 0 : 1;
      taught[half].push_back(add_task(plan, {step, leaf, {judges[half], lessons[1 - half]}}));
    }
    for (int half = 0; half < 2; ++half) lessons[half] = reduce(plan, FleetStep::add, taught[half]);
  }
  if (lessons[1] == kFleetNothing) return lessons[0];
  return add_task(plan, {FleetStep::add, -1, {lessons[0], lessons[1]}});
}

Model model_in(const FleetValue& value) {
  if (const Model* model = std::get_if<Model>(&value)) return *model;
  if (std::holds_alternative<std::monostate>(value)) return {};
  throw std::invalid_argument("run_task: an input is lessons where a model should be");
}

Lessons lessons_in(const FleetValue& value) {
  if (const Lessons* lessons = std::get_if<Lessons>(&value)) return *lessons;
  if (std::holds_alternative<std::monostate>(value)) return {};
  throw std::invalid_argument("run_task: an input is a model where lessons should be");
}

std::vector<double> widths_of(std::span<const Leaf> leaves) {
  std::vector<double> widths_m;
  for (const Leaf& leaf : leaves) {
    if (leaf.model)
      widths_m.push_back(leaf.model->conventions.reference_width_m);
    else if (!leaf.tracks.empty())
      widths_m.push_back(leaf.tracks.front().frame.sidewalk_width_m);
  }
  return widths_m;
}

using Batches = std::vector<std::span<const PlacedTrack>>;

Batches batches_of(const Leaf& leaf) {
  if (leaf.batch == 0) throw std::invalid_argument("leaf: batch = 0, must be at least 1");
  const std::span<const PlacedTrack> tracks = leaf.tracks;
  Batches batches;
  for (std::size_t from = 0; from < tracks.size(); from += leaf.batch) {
    batches.push_back(tracks.subspan(from, std::min(leaf.batch, tracks.size() - from)));
    if (std::ranges::binary_search(leaf.left_out, episode_id(batches.back()))) batches.pop_back();
  }
  return batches;
}

Model learn_leaf(const Leaf& leaf, EpisodeConfig config) {
  config.lessons.enabled = false;
  Model model = leaf.model.value_or(Model{});
  model.lessons = {};
  const Update update = sila_update(config);
  for (const auto& batch : batches_of(leaf)) model = run_episode(model, batch, config, update).model;
  return model;
}

Lessons teach(const Leaf& leaf, Model known, const Lessons& lessons, const EpisodeConfig& config) {
  if (leaf.model) return leaf.model->lessons;
  known.lessons = add_lessons(known.lessons, lessons, 1.0);
  std::vector<PlacedTrack> tracks;
  for (const auto& batch : batches_of(leaf)) tracks.insert(tracks.end(), batch.begin(), batch.end());
  return lessons_on(known, tracks, config);
}

FuseConfig fusing(const EpisodeConfig& config) {
  FuseConfig fuse = config.fuse;
  fuse.case_3_fuses_stronger = config.fleet.case_3_fuses_stronger;
  fuse.mean = config.fleet.mean;
  return fuse;
}

/// As an episode does: what became rare beside the other half is absorbed or forgotten.
Model fuse_halves(const Model& first, const Model& second, const EpisodeConfig& config) {
  const FuseConfig fuse = fusing(config);
  Model fused = fuse_models(first, second, fuse, config.outlook).model;
  return compact(std::move(fused), config.compact, fuse, config.outlook).model;
}

EpisodeConfig rehearsing(EpisodeConfig config) {
  constexpr double kSparser = 4.0;
  config.lessons.every_s *= kSparser;
  return config;
}

/// What was known before fades as if the new episodes had come one after another.
Model finish(Model model, const Lessons& lessons, const Model& start, const EpisodeConfig& config) {
  model.lessons = add_lessons(start.lessons, lessons, std::pow(config.lessons.decay, model.episodes - start.episodes));
  return limit(std::move(model), config.model, config.compact).model;
}

}  // namespace

std::vector<EpisodeId> episodes_of(const Leaf& leaf) {
  if (leaf.model) return leaf.model->episode_ids;
  std::set<EpisodeId> ids;
  for (const auto& batch : batches_of(leaf)) ids.insert(episode_id(batch));
  return {ids.begin(), ids.end()};
}

std::vector<ChosenLeaf> choose_leaves(std::span<const std::vector<EpisodeId>> episodes,
                                      const std::vector<EpisodeId>& known) {
  std::vector<std::size_t> order(episodes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return episodes[a] < episodes[b]; });
  std::set<EpisodeId> taken(known.begin(), known.end());
  std::vector<ChosenLeaf> chosen;
  for (const std::size_t leaf : order) {
    ChosenLeaf choice{leaf, {}};
    std::ranges::copy_if(episodes[leaf], std::back_inserter(choice.left_out),
                         [&](const EpisodeId& id) { return taken.contains(id); });
    taken.insert(episodes[leaf].begin(), episodes[leaf].end());
    if (choice.left_out.size() < episodes[leaf].size()) chosen.push_back(std::move(choice));
  }
  return chosen;
}

Plan plan_fleet(int leaves, bool goes_on, const EpisodeConfig& config) {
  if (leaves < 1)
    throw std::invalid_argument("plan_fleet: leaves = " + std::to_string(leaves) + ", must be at least 1");
  Plan plan;
  std::vector<int> learnt;
  for (int leaf = 0; leaf < leaves; ++leaf) learnt.push_back(add_task(plan, {FleetStep::learn, leaf, {}}));
  const int middle = (leaves + 1) / 2;
  const auto split = static_cast<std::size_t>(middle);
  const int halves[2] = {reduce(plan, FleetStep::fuse, std::span(learnt).first(split)),
                         reduce(plan, FleetStep::fuse, std::span(learnt).subspan(split))};
  int lessons = kFleetNothing;
  if (config.lessons.enabled) {
    const int judges[2] = {with_start(plan, goes_on, halves[1]), with_start(plan, goes_on, halves[0])};
    lessons = add_rounds(plan, judges, leaves, middle, config.fleet.lesson_rounds);
  }
  const int whole =
      halves[1] == kFleetNothing ? halves[0] : add_task(plan, {FleetStep::fuse, -1, {halves[0], halves[1]}});
  const int model = with_start(plan, goes_on, whole);
  add_task(plan, {FleetStep::finish, -1, {model, lessons, goes_on ? kFleetStart : kFleetNothing}});
  return plan;
}

FleetValue run_task(FleetStep step, const Leaf& leaf, Inputs inputs, const EpisodeConfig& config) {
  const auto input = [&](std::size_t i) -> const FleetValue& {
    if (i >= inputs.size())
      throw std::invalid_argument("run_task: inputs = " + std::to_string(inputs.size()) + ", too few");
    return *inputs[i];
  };
  switch (step) {
    case FleetStep::learn:
      return learn_leaf(leaf, config);
    case FleetStep::fuse:
      return fuse_halves(model_in(input(0)), model_in(input(1)), config);
    case FleetStep::rehearse:
      return teach(leaf, model_in(input(0)), lessons_in(input(1)), rehearsing(config));
    case FleetStep::teach:
      return teach(leaf, model_in(input(0)), lessons_in(input(1)), config);
    case FleetStep::add:
      return add_lessons(lessons_in(input(0)), lessons_in(input(1)), 1.0);
    default:
      return finish(model_in(input(0)), lessons_in(input(1)), model_in(input(2)), config);
  }
}

double agreed_width_m(std::vector<double> widths_m) {
  if (widths_m.empty()) throw std::invalid_argument("agreed_width_m: widths_m = none, must be at least one");
  std::ranges::sort(widths_m);
  return widths_m[(widths_m.size() - 1) / 2];
}

Model learn_fleet(const Model& start, std::vector<Leaf> leaves, EpisodeConfig config) {
  if (leaves.empty()) return start;
  if (config.reference_width_m == 0.0 && start.episodes == 0)
    config.reference_width_m = agreed_width_m(widths_of(leaves));
  std::vector<std::vector<EpisodeId>> episodes;
  for (const Leaf& leaf : leaves) episodes.push_back(episodes_of(leaf));
  const std::vector<ChosenLeaf> chosen = choose_leaves(episodes, start.episode_ids);
  if (chosen.empty()) return start;
  for (const ChosenLeaf& choice : chosen) leaves[choice.leaf].left_out = choice.left_out;
  const FleetValue begin = start, nothing;
  const Leaf none;
  std::vector<FleetValue> values;
  const Plan plan = plan_fleet(static_cast<int>(chosen.size()), start.episodes > 0, config);
  for (const FleetTask& task : plan) {
    std::vector<const FleetValue*> inputs;
    for (const int from : task.inputs)
      inputs.push_back(from == kFleetStart     ? &begin
                       : from == kFleetNothing ? &nothing
                                               : &values[static_cast<std::size_t>(from)]);
    const Leaf& leaf = task.leaf < 0 ? none : leaves[chosen[static_cast<std::size_t>(task.leaf)].leaf];
    values.push_back(run_task(task.step, leaf, inputs, config));
  }
  return std::get<Model>(std::move(values.back()));
}

}  // namespace sila
