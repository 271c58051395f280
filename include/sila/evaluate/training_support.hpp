#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/predict/prediction.hpp"

namespace sila {

/// The person of a track: tracklets of one person are "17", "17#2", ... An id "#2" of the input is a person.
std::string person_of(const std::string& track_id);

/// How people are held back.
enum class SplitBy {
  time,   ///< a block of time, with an embargo around it: companions never leak
  track,  ///< people at random: companions of a held-back person are learnt from
};
inline constexpr const char* kSplitBy[] = {"time", "track"};

/// Embargo [s]: training leaves out pedestrians who were present within this time of a held-back block.
inline constexpr double kEmbargo_s = 5.0;

/// Tracks to learn from, in the order of learning, and tracks held back.
struct Split {
  std::vector<FramedTrajectory> train;
  std::vector<FramedTrajectory> test;
};

/// Holds back a share of the people, never single windows; all tracklets of a person are on one side. By time: the
/// recordings are put end to end in an order by the seed; from a random person on, consecutive people are held
/// back. Their block ends a typical stay (75 % quantile) after the last of them came; their tracks are cut there. Other
/// people are learnt from if they were not present within the embargo of a block, in the order of recording and begin.
/// By track: people are drawn in an order by the seed. The same seed gives the same split on every machine. Throws:
/// std::invalid_argument for a share outside [0, 1), a track that breaks its invariant, and by time for a single
/// recording without a clock: all of its tracks begin at one instant.
Split split_tracks(std::vector<FramedTrajectory> tracks, double test_share, std::uint64_t seed, SplitBy by);

/// The same with a number of people to hold back.
Split split_people(std::vector<FramedTrajectory> tracks, std::size_t test_people, std::uint64_t seed, SplitBy by);

/// The ground that tracks cover: square cells of the world, with sides of 1 m, sorted, each once.
using CoveredArea = std::vector<std::pair<int, int>>;

/// The cells that the tracks touch, and all cells that border on one of them.
CoveredArea covered_area(std::span<const FramedTrajectory> tracks);

/// Whether a position lies in one of the cells.
bool contains(const CoveredArea& area, const Vector2& position_m);

/// The simple predictors that every other one is compared with. All begin at the last raw position.
enum class Reference {
  constant_velocity,  ///< mean velocity of the last 0.8 s
  stays,              ///< at the last position
  damped_velocity,    ///< constant velocity, of which each step takes the share that suits the training windows best
  linear,             ///< ridge regression on all observed positions in the heading frame
};
inline constexpr const char* kReferences[] = {"constant_velocity", "stays", "damped_velocity", "linear"};
inline constexpr std::size_t kReferenceCount = std::size(kReferences);

/// A predictor that is linear in the past positions, with a separate Gaussian error for each step.
struct LinearReference {
  Reference kind = Reference::constant_velocity;
  Eigen::MatrixXd weights;              ///< (inputs x 2 steps): displacements that are added to constant velocity
  std::vector<double> shares;           ///< of constant velocity, for each step; none: all of it
  std::vector<Matrix2> covariances_m2;  ///< of the error at each step, in the heading frame

  /// The prediction for a path of the past, sampled as those that it was fitted to. Shapes: as many steps as fitted.
  Prediction predict(std::span<const Vector2> past_m, double interval_s) const;
};

/// A reference without training windows: errors of 1 m/s times the time ahead, and `linear` and `damped_velocity` are
/// constant velocity. Shapes: `steps` steps of `interval_s`.
LinearReference unfitted_reference(Reference kind, std::size_t steps, double interval_s);

/// The first `count` references, fitted to windows with their whole future; without windows `unfitted_reference`. The
/// ridge is the one with the least error over five folds of tracks, and the errors are those of the held-back folds.
/// Shapes: as `unfitted_reference`. Source: Schoeller et al., "What the constant velocity model can teach us about
/// pedestrian motion prediction", 2020, on why such baselines are needed; ridge regression: Hastie, Tibshirani,
/// Friedman, section 3.4.
std::vector<LinearReference> fit_references(std::span<const Window* const> windows, std::size_t steps,
                                            double interval_s, std::size_t count = kReferenceCount);

/// Position and velocity of a training window at t0, and its displacement after t0, in the world frame.
struct Passage {
  std::string person;
  Vector2 position_m = Vector2::Zero();
  Vector2 velocity_mps = Vector2::Zero();  ///< of the last 0.8 s
  Vector2 way_m = Vector2::Zero();         ///< displacement from t0 to the horizon
};

/// The passage of each window that has its whole future.
std::vector<Passage> passages_of(std::span<const Window> windows, double interval_s);

/// A way to continue from one place: to stay, or a direction.
struct Way {
  bool stays = false;
  double direction_rad = 0.0;
  double share = 0.0;  ///< of the similar passages
};

/// The ways of the similar passages, which are those within 2 m and 0.5 m/s of the window, of each person the most
/// similar one. Passages of less than 1 m stay; gaps of at least 20 degrees separate the directions of the others. Ways
/// that less than 15 % of the people took are left out; with fewer than 12 people there is no way. Source: own rule,
/// docs/evaluate.md.
std::vector<Way> ways_on(std::span<const Passage> passages, const Window& window, double interval_s);

/// At a fork (two or more `ways`): the probability that a prediction gives, at the whole horizon, to the way that the
/// window took; at least 1e-4. Elsewhere null. Every position belongs to the nearest way: within 1 m of the start to
/// staying, else to the nearest direction.
/// Differs from a likelihood: only the choice of the way counts, not how far along it the person went.
std::optional<double> probability_of_way_taken(const Prediction& prediction, const Window& window,
                                               std::span<const Way> ways);

/// References that are fitted to windows of people who stand, and to those of people who move.
using ReferencesByMotion = std::array<std::vector<LinearReference>, 2>;

/// Results of the training tracks that an evaluation uses.
struct TrainingSupport {
  CoveredArea area;
  ReferencesByMotion references;
  std::vector<Passage> passages;  ///< where its windows led
};

}  // namespace sila
