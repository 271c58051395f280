#pragma once

#include <concepts>
#include <string>
#include <vector>

#include "sila/evaluate/split.hpp"
#include "sila/experiment/course.hpp"

namespace sila {

enum class ExperimentKind {
  one_place,  ///< each scene by itself
  places,     ///< all scenes one after another, judged at all of them
  transfer,   ///< learnt at all scenes but one and judged there; beside it, learnt there
};
inline constexpr const char* kExperimentKinds[] = {"one_place", "places", "transfer"};

/// What an experiment does with its scenes and methods.
struct ExperimentConfig {
  ExperimentKind kind = ExperimentKind::one_place;
  int trials = 12;
  SplitBy split = SplitBy::time;
  double test_share = 0.15;
  int test_tracks = 0;
  int train_tracks = 0;
  bool take_fewer = false;
  double min_track_s = 0.0;
  int batch = 20;
  std::uint64_t seed = 100;
  bool every_episode = false;
  int orders = 1;
  int bootstraps = 2000;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, ExperimentConfig>
void fields(Config& config, Visitor&& visit) {
  visit.choice("kind", config.kind, kExperimentKinds, "what is learnt where and judged where");
  visit.number("trials", config.trials, Range{1, 10000}, "-", "each with its own split and its own order of tracks");
  visit.choice("split", config.split, kSplitBy,
               "people held back: a block of time with an embargo around it, or people at random (companions leak)");
  visit.number("test_share", config.test_share, Range{0.0, 0.9, true}, "-", "share of a scene's people held back");
  visit.number("test_tracks", config.test_tracks, Range{0, 1e9}, "tracks",
               "held back at each scene; with train_tracks instead of test_share");
  visit.number("train_tracks", config.train_tracks, Range{0, 1e9}, "tracks", "learnt at each scene; 0: all the others");
  visit.flag("take_fewer", config.take_fewer, "of a scene with fewer tracks take fewer, in the same proportion");
  visit.number("min_track_s", config.min_track_s, Range{0.0, 1e6}, "s", "shorter tracks are left out");
  visit.number("batch", config.batch, Range{1, 1e6}, "tracks", "of an episode");
  visit.number("seed", config.seed, Range{0, 9e15}, "-", "of trial 1; each further trial adds one");
  visit.flag("every_episode", config.every_episode, "judge after every episode, not after the last one alone");
  visit.number("orders", config.orders, Range{0, 100000}, "-",
               "of the scenes, for `places`: the listed one and shuffled ones; 0: every order");
  visit.number("bootstraps", config.bootstraps, Range{100, 1e6}, "-", "resamplings behind an interval");
}

/// The tracks of one scene, and how they are judged there.
struct Place {
  std::string name;
  std::vector<FramedTrajectory> tracks;
  EvaluateConfig evaluate;
};

/// A method under one name, with its configuration at each place.
/// Invariant: as many as there are places; for `places` and `transfer` they are alike.
using MethodAtPlaces = std::vector<Method>;

struct Experiment {
  ExperimentConfig config;
  std::vector<Place> places;
  std::vector<MethodAtPlaces> methods;
};

/// One piece of work, the smallest that is kept when a run is interrupted.
struct Job {
  int trial = 0;       ///< from 1
  int order = 0;       ///< of the places, from 1; 0 where there is none
  std::string scene;   ///< "all" for `places`
  std::string method;  ///< its name; with " here" where a transfer is compared with learning at the place itself
  std::size_t place = 0;
  std::size_t method_index = 0;
  bool here = true;  ///< learns at the place where it is judged
};

/// Throws: std::invalid_argument for a field out of range, no place, no method, two of one name, or a split larger than
/// the data (naming the place).
void check(const Experiment& experiment);

/// All jobs, trial by trial, in the order in which they should be done.
std::vector<Job> jobs_of(const Experiment& experiment);

/// Orders of the places, as indices: the listed one first. The same seed gives the same orders on every machine.
std::vector<std::vector<std::size_t>> orders_of(std::size_t places, int orders, std::uint64_t seed);

/// The split of one place in one trial; where counts are asked for, the first tracks to learn from are taken.
Split split_place(const Place& place, const ExperimentConfig& config, int trial);

/// What the method of a job is put through.
Course course_of(const Experiment& experiment, const Job& job);
const Method& method_of(const Experiment& experiment, const Job& job);

}  // namespace sila
