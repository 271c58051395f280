#include "sila/experiment/experiment.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>
#include <stdexcept>

#include "sila/evaluate/split.hpp"

namespace sila {
namespace {

std::vector<FramedTrajectory> long_enough(const Place& place, double min_track_s) {
  std::vector<FramedTrajectory> tracks;
  for (const FramedTrajectory& placed : place.tracks) {
    if (placed.track.times_s.back() - placed.track.times_s.front() >= min_track_s) tracks.push_back(placed);
  }
  return tracks;
}

struct Counts {
  std::size_t test = 0;
  std::size_t train = 0;
};

/// How many tracks are held back and learnt of so many; fewer of both where that is allowed.
Counts counts_for(std::size_t tracks, const ExperimentConfig& config) {
  Counts counts{static_cast<std::size_t>(config.test_tracks), static_cast<std::size_t>(config.train_tracks)};
  const std::size_t wanted = counts.test + counts.train;
  if (wanted > tracks && config.take_fewer) {
    const double share = static_cast<double>(counts.test) / static_cast<double>(wanted);
    counts.test = static_cast<std::size_t>(std::lround(share * static_cast<double>(tracks)));
    counts.train = tracks - counts.test;
  }
  if (config.train_tracks == 0) counts.train = tracks - std::min(tracks, counts.test);
  return counts;
}

void check_place(const Place& place, const ExperimentConfig& config) {
  const std::size_t tracks = long_enough(place, config.min_track_s).size();
  const auto refuse = [&](const std::string& rule) {
    throw std::invalid_argument("experiment: scene '" + place.name + "' has " + std::to_string(tracks) + " tracks" +
                                (config.min_track_s > 0.0 ? " that are long enough, " : ", ") + rule);
  };
  if (tracks < 2) refuse("needs at least 2");
  const std::size_t wanted =
      static_cast<std::size_t>(config.test_tracks) + static_cast<std::size_t>(config.train_tracks);
  if (config.test_tracks > 0 && wanted > tracks && !config.take_fewer) {
    refuse("fewer than test_tracks = " + std::to_string(config.test_tracks) + " and train_tracks = " +
           std::to_string(config.train_tracks) + " together; ask for fewer, or set take_fewer");
  }
  Split split;
  try {
    split = split_place(place, config, 1);
  } catch (const std::invalid_argument& error) {
    refuse(error.what());
  }
  const auto least = static_cast<std::size_t>(config.take_fewer ? 1 : std::max(1, config.train_tracks));
  if (split.test.empty() || split.train.size() < least) {
    refuse(
        "of which " + std::to_string(split.test.size()) + " would be held back and " +
        std::to_string(split.train.size()) + " learnt from, must be at least 1 and " + std::to_string(least) +
        (config.split == SplitBy::time ? "; the embargo leaves out those who were there with held-back people" : ""));
  }
}

/// The tracks in the units of a method.
Split rescaled(Split split, CurbScaling scaling) {
  for (std::vector<FramedTrajectory>* side : {&split.train, &split.test}) {
    for (FramedTrajectory& placed : *side) placed.frame = sila::rescaled(placed.frame, scaling);
  }
  return split;
}

JudgedPlace judged_place(const Place& place, Split split, const EpisodeConfig& config) {
  return {place.name, std::move(split.test), background_of(split.train, config, place.evaluate), place.evaluate};
}

}  // namespace

std::vector<std::vector<std::size_t>> orders_of(std::size_t places, int orders, std::uint64_t seed) {
  std::vector<std::size_t> order(places);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<std::vector<std::size_t>> all;
  do all.push_back(order);
  while (all.size() < 5040 && std::ranges::next_permutation(order).found);
  std::mt19937_64 random(seed);
  for (std::size_t i = all.size(); orders > 0 && i > 2; --i) std::swap(all[i - 1], all[1 + random() % (i - 1)]);
  if (orders > 0) all.resize(std::min(all.size(), static_cast<std::size_t>(orders)));
  return all;
}

Split split_place(const Place& place, const ExperimentConfig& config, int trial) {
  const std::uint64_t seed = config.seed + static_cast<std::uint64_t>(trial - 1);
  std::vector<FramedTrajectory> tracks = long_enough(place, config.min_track_s);
  if (config.test_tracks == 0) return split_tracks(std::move(tracks), config.test_share, seed, config.split);
  const Counts counts = counts_for(tracks.size(), config);
  Split split = split_people(std::move(tracks), counts.test, seed, config.split);
  if (split.train.size() > counts.train) split.train.resize(counts.train);
  return split;
}

void check(const Experiment& experiment) {
  validate_fields("experiment", experiment.config);
  if (experiment.config.train_tracks > 0 && experiment.config.test_tracks == 0)
    throw std::invalid_argument("experiment: train_tracks needs test_tracks beside it");
  if (experiment.places.empty()) throw std::invalid_argument("experiment: scenes = none, needs at least one");
  if (experiment.methods.empty()) throw std::invalid_argument("experiment: methods = none, needs at least one");
  if (experiment.config.kind != ExperimentKind::one_place && experiment.places.size() < 2)
    throw std::invalid_argument("experiment: scenes = one, this kind needs at least two");
  std::set<std::string> names;
  for (const Place& place : experiment.places) {
    if (!names.insert(place.name).second)
      throw std::invalid_argument("experiment: scenes has '" + place.name + "' twice, names must differ");
    check_place(place, experiment.config);
  }
  names.clear();
  for (const MethodAtPlaces& method : experiment.methods) {
    if (!names.insert(method.at(0).name).second)
      throw std::invalid_argument("experiment: methods has '" + method[0].name + "' twice, names must differ");
  }
}

std::vector<Job> jobs_of(const Experiment& experiment) {
  const ExperimentConfig& config = experiment.config;
  std::vector<Job> jobs;
  const auto add = [&](Job job) {
    job.method = experiment.methods[job.method_index][0].name;
    jobs.push_back(std::move(job));
  };
  for (int trial = 1; trial <= config.trials; ++trial) {
    if (config.kind == ExperimentKind::places) {
      const auto orders = orders_of(experiment.places.size(), config.orders, config.seed);
      for (int order = 1; order <= static_cast<int>(orders.size()); ++order) {
        for (std::size_t m = 0; m < experiment.methods.size(); ++m) add({trial, order, "all", {}, 0, m, true});
      }
      continue;
    }
    for (std::size_t p = 0; p < experiment.places.size(); ++p) {
      for (std::size_t m = 0; m < experiment.methods.size(); ++m) {
        const bool transfer = config.kind == ExperimentKind::transfer;
        add({trial, 0, experiment.places[p].name, {}, p, m, !transfer});
        if (!transfer) continue;
        add({trial, 0, experiment.places[p].name, {}, p, m, true});
        jobs.back().method += " here";
      }
    }
  }
  return jobs;
}

const Method& method_of(const Experiment& experiment, const Job& job) {
  return experiment.methods.at(job.method_index).at(job.place);
}

Course course_of(const Experiment& experiment, const Job& job) {
  const ExperimentConfig& config = experiment.config;
  const EpisodeConfig& episode = method_of(experiment, job).config;
  const auto split_at = [&](std::size_t place) {
    return rescaled(split_place(experiment.places.at(place), config, job.trial), episode.scaling);
  };
  Course course;
  course.batch = static_cast<std::size_t>(config.batch);
  course.judge_every_episode = config.every_episode;
  if (config.kind == ExperimentKind::places) {
    const auto orders = orders_of(experiment.places.size(), config.orders, config.seed);
    for (std::size_t p : orders.at(static_cast<std::size_t>(job.order - 1))) {
      Split split = split_at(p);
      course.stages.push_back(split.train);
      course.judged.push_back(judged_place(experiment.places[p], std::move(split), episode));
    }
    return course;
  }
  Split here = split_at(job.place);
  if (job.here) course.stages.push_back(here.train);
  for (std::size_t p = 0; !job.here && p < experiment.places.size(); ++p) {
    if (p != job.place) course.stages.push_back(split_at(p).train);
  }
  course.judged.push_back(judged_place(experiment.places[job.place], std::move(here), episode));
  return course;
}

}  // namespace sila
