#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "learn/dictionary.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/learn/learn.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// Cuts a track into segments of the primitives that its code uses: the best labelling of all samples, where a label
/// scores coefficient * (arrow . heading) and each change of label costs a penalty. Samples without a heading
/// score nothing and take the label that suits their neighbours; short runs join the run before. Returns no segment if
/// the code uses no primitive enough. Neighbours differ. Source: docs/learn.md, section 6. Differs: a Viterbi pass
/// instead of sample-wise maxima; see docs/decisions/0003-segmentation.md.
std::vector<Segment> segment(const CurbTrajectory& track, std::span<const Coefficient> code,
                             std::span<const MotionPrimitive> primitives, const Grid& grid);

/// One transition in the tracks of a batch.
struct ObservedTransition {
  std::vector<SiteCount> sites;  ///< trajectories that showed it, T(i, j), by site
  GpData samples;
};

/// From and to of a transition.
using TransitionKey = std::pair<int, int>;

/// Counts each transition at most once per trajectory and gathers the samples of both of its segments. A track of one
/// segment makes a self transition, so that its data are not lost. Shapes: `segments` has a list and `sites` the index
/// of a site for each track. Samples are measured velocities, slow ones included, so that fields show where people slow
/// down; of each stretch of a track one every `stride_s`, or all if that is 0. Source: SILA paper, T(i, j);
/// docs/learn.md, section 7.
std::map<TransitionKey, ObservedTransition> observe_transitions(std::span<const CurbTrajectory> tracks,
                                                                std::span<const std::vector<Segment>> segments,
                                                                std::span<const int> sites, double stride_s = 0.0);

}  // namespace sila
