#include "sila/experiment/course.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <stdexcept>
#include <utility>

#include "sila/core/steps.hpp"
#include "sila/train/fleet.hpp"
#include "sila/train/training.hpp"

namespace sila {
namespace {

using Tracks = std::span<const FramedTrajectory>;

/// Something that learns batch by batch and can be asked at any time.
struct Learner {
  std::function<void(Tracks)> learn;
  std::function<Forecast()> forecast;  ///< stays valid while nothing is learnt
  std::function<std::size_t()> size;
};

/// Keeps nothing of the tracks; the episode around it still learns from the errors of kinematics.
Update kinematics_update() {
  return [](const Model& previous, const Batch& batch, const ModelSettings& settings) {
    Updated updated;
    updated.model.settings = settings;
    updated.model.sites = join_sites(previous.sites, sites_of(batch.tracks)).sites;
    updated.model.episodes = previous.episodes + 1;
    updated.model.tracks = previous.tracks + static_cast<long>(batch.tracks.size());
    return updated;
  };
}

Update update_of(const Method& method) {
  switch (method.kind) {
    case MethodKind::accumulate:
      return accumulate_update(method.config);
    case MethodKind::retrain:
      return retrain_update(method.config);
    case MethodKind::kinematics:
      return kinematics_update();
    default:
      return sila_update(method.config);
  }
}

std::function<Forecast()> forecast_of(const std::shared_ptr<Model>& model, const PredictConfig& config) {
  return [model, config] {
    auto predictor = std::make_shared<const Predictor>(*model, config);
    return [predictor](const CurbTrajectory& observed) { return predictor->predict(observed); };
  };
}

Learner model_learner(const Method& method) {
  auto model = std::make_shared<Model>();
  const bool at_once = method.kind == MethodKind::batch;
  return {[model, config = method.config, update = update_of(method), at_once](Tracks batch) {
            Training run =
                at_once ? train_batch(batch, config) : run_episodes(*model, batch, batch.size(), config, update);
            *model = std::move(run.model);
          },
          forecast_of(model, method.config.predict), [model] { return size(*model); }};
}

Learner tree_learner(const Method& method, std::size_t batch) {
  auto model = std::make_shared<Model>();
  const std::size_t leaf_tracks = batch * static_cast<std::size_t>(method.tree.leaf_episodes);
  return {[=, config = method.config](Tracks tracks) {
            std::vector<Leaf> leaves;
            std::vector<Site> sites;
            std::vector<std::size_t> filling;  // of each site the leaf that has room, as a fleet's sources are sites
            for (const FramedTrajectory& track : tracks) {
              const auto site = static_cast<std::size_t>(find_or_add_site(sites, track.frame));
              const bool first = site == filling.size();
              if (first) filling.push_back(0);
              if (first || leaves[filling[site]].tracks.size() == leaf_tracks) {
                filling[site] = leaves.size();
                leaves.push_back({{}, batch, {}, {}});
              }
              leaves[filling[site]].tracks.push_back(track);
            }
            *model = learn_fleet(*model, std::move(leaves), config);
          },
          forecast_of(model, method.config.predict), [model] { return size(*model); }};
}

Learner memory_learner(const Method& method, int steps) {
  auto memory = std::make_shared<TrackMemory>();
  return {[=](Tracks batch) { *memory = remember(std::move(*memory), batch, method.config, method.memory); },
          [=] {
            return [=](const CurbTrajectory& observed) {
              return predict(*memory, observed, steps, method.config.sampling.interval_s, method.memory);
            };
          },
          [=] { return memory->windows.size(); }};
}

Learner cliff_learner(const Method& method, int steps) {
  auto map = std::make_shared<CliffMap>();
  return {[=](Tracks batch) { *map = map_dynamics(std::move(*map), batch, method.config, method.cliff); },
          [=] {
            return [=](const CurbTrajectory& observed) {
              return predict(*map, observed, steps, method.config.sampling.interval_s, method.cliff);
            };
          },
          [=] { return size(*map); }};
}

bool learns_at_once(const Method& method) {
  return method.kind == MethodKind::batch || method.kind == MethodKind::tree;
}

Learner learner_of(const Method& method, std::size_t batch) {
  const int steps = steps_in(method.config.predict.horizon_s, method.config.sampling.interval_s);
  if (method.kind == MethodKind::memory) return memory_learner(method, steps);
  if (method.kind == MethodKind::cliff) return cliff_learner(method, steps);
  if (method.kind == MethodKind::tree) return tree_learner(method, batch);
  return model_learner(method);
}

/// The batches of a course, each of one place; all in one for a method that learns all at once.
std::vector<std::vector<FramedTrajectory>> batches_of(const Course& course, bool at_once) {
  std::vector<std::vector<FramedTrajectory>> batches;
  for (const std::vector<FramedTrajectory>& stage : course.stages) {
    for (std::size_t i = 0; i < stage.size(); ++i) {
      if (batches.empty() || (!at_once && i % course.batch == 0)) batches.emplace_back();
      batches.back().push_back(stage[i]);
    }
  }
  return batches;
}

}  // namespace

std::vector<Milestone> run_course(const Course& course, const Method& method) {
  if (course.batch == 0) throw std::invalid_argument("run_course: batch = 0, must be at least 1");
  const auto batches = batches_of(course, learns_at_once(method));
  if (batches.empty()) throw std::invalid_argument("run_course: stages hold no track, must have at least one");
  const Learner learner = learner_of(method, course.batch);
  std::vector<Milestone> milestones;
  for (const std::vector<FramedTrajectory>& batch : batches) {
    Milestone milestone;
    milestone.episode = static_cast<int>(milestones.size()) + 1;
    milestone.tracks = (milestones.empty() ? 0 : milestones.back().tracks) + batch.size();
    const auto started = std::chrono::steady_clock::now();
    learner.learn(batch);
    milestone.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    milestone.size = learner.size();
    if (course.judge_every_episode || milestone.episode == static_cast<int>(batches.size())) {
      const Forecast forecast = learner.forecast();
      for (const JudgedPlace& place : course.judged) {
        milestone.places.push_back(
            {place.name, evaluate_forecast(forecast, place.test, method.config, place.config, &place.background)});
      }
    }
    milestones.push_back(std::move(milestone));
  }
  return milestones;
}

}  // namespace sila
