#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/learn/segmentation.hpp"
#include "sila/model/batch.hpp"
#include "sila/model/increment.hpp"

namespace sila {

/// What the tracks of a batch showed of one transition.
struct ObservedTransition {
  double count = 0.0;  ///< trajectories that showed it, T(i, j)
  TransitionSamples samples;
};

/// From and to of a transition.
using TransitionKey = std::pair<int, int>;

/// Counts each transition at most once a trajectory and gathers the samples of both of its segments; a track of one
/// segment makes a self transition, so that its data are not lost. Shapes: one list of segments a track. Samples are
/// real velocities, slow ones included: that people slow down here is worth knowing. Source: SILA paper, T(i, j);
/// algorithms 1.10.
std::map<TransitionKey, ObservedTransition> observe_transitions(std::span<const CurbTrajectory> tracks,
                                                                std::span<const std::vector<Segment>> segments);

/// The outlook examples of each transition: those of the moments at which somebody was in its first primitive and went
/// on to its second (or had come from the first, if the track ends in the second). Shapes: states 6 x m, partings m x
/// 2 per knot. Moments of tracks without segments teach nothing.
struct OutlookSamples {
  Eigen::MatrixXd states;
  Eigen::MatrixXd partings;
};
std::map<TransitionKey, OutlookSamples> observe_outlooks(const Batch& batch,
                                                         std::span<const std::vector<Segment>> segments);

}  // namespace sila
