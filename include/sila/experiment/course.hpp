#pragma once

#include <concepts>
#include <string>
#include <vector>

#include "sila/evaluate/evaluate.hpp"
#include "sila/experiment/baselines/cliff.hpp"
#include "sila/experiment/baselines/memory.hpp"

namespace sila {

/// Who learns. Constant velocity is judged beside each of them.
enum class MethodKind {
  sila,        ///< learn, then fuse
  accumulate,  ///< learn, then add without fusing
  retrain,     ///< after each batch anew from all tracks so far
  batch,       ///< once, from all tracks
  kinematics,  ///< past velocities stacked by past errors; no map
  memory,      ///< nearest of all windows so far
  cliff,       ///< map of dynamics
  tree,        ///< as a fleet does: leaves learnt by themselves, fused in a tree
};
inline constexpr const char* kMethodKinds[] = {"sila",       "accumulate", "retrain", "batch",
                                               "kinematics", "memory",     "cliff",   "tree"};

/// How a fleet is played through.
struct TreeConfig {
  int leaf_episodes = 1;
};

template <class Config, class Visitor>
requires std::same_as<std::remove_const_t<Config>, TreeConfig>
void fields(Config& config, Visitor&& visit) {
  visit.number("leaf_episodes", config.leaf_episodes, Range{1, 1e6}, "-", "that each leaf learns one after another");
}

struct Method {
  std::string name;
  MethodKind kind = MethodKind::sila;
  EpisodeConfig config;
  MemoryConfig memory;
  CliffConfig cliff;
  TreeConfig tree;
};

/// Tracks held back at one place, and what its own training tracks tell the judge.
struct JudgedPlace {
  std::string name;
  std::vector<FramedTrajectory> test;
  Background background;
  EvaluateConfig config;
};

/// What one method is put through: the tracks of one place after those of another, in batches that are of one place
/// each, and the places where it is judged.
struct Course {
  std::vector<std::vector<FramedTrajectory>> stages;
  std::vector<JudgedPlace> judged;
  std::size_t batch = 20;
  bool judge_every_episode = false;  ///< else after the last one alone
};

struct PlaceEvaluation {
  std::string place;
  Evaluation evaluation;
};

/// The state after one episode.
struct Milestone {
  int episode = 0;                      ///< from 1
  std::size_t tracks = 0;               ///< learnt so far
  std::size_t size = 0;                 ///< of the model; windows of a memory, Gaussians of a map of dynamics
  double seconds = 0.0;                 ///< that the episode took to learn
  std::vector<PlaceEvaluation> places;  ///< empty if it was not judged
};

/// One milestone an episode; the last one is always judged. Methods that learn all at once have one episode.
/// Throws: std::invalid_argument for a course without tracks, or a configuration out of range.
std::vector<Milestone> run_course(const Course& course, const Method& method);

}  // namespace sila
