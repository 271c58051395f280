#pragma once

#include <Eigen/Core>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "sila/core/grid.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/learn/learn.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// A trajectory on the grid, tr_i of the paper: the unit velocity in each cell that it visits.
struct GridVector {
  std::vector<CellKey> path;        ///< visited cells in the order of the first visit, each once
  std::vector<Vector2> directions;  ///< unit velocity of each; zero where the person turned about (inactive)
};

/// Maps trajectories to the grid. Samples below DictionaryConfig::min_speed_mps have no heading and are skipped; a cell
/// crossed between two samples is found by linear sub-samples; a cell whose headings cancel (mean below 0.3) stays
/// inactive. Source: SILA paper, section on ASNSC ("k-th entry is the normalised velocity in cell k"); docs/learn.md,
/// section 1.
GridVector to_grid_vector(const CurbTrajectory& track, const Grid& grid);

/// Projects an arrow (x, y, b) onto the convex set |(x, y)| <= b <= 1 (nearest point in the Euclidean norm): no arrow
/// is longer than its activeness, and the activeness is at most 1. So no two primitives cancel each other. Source:
/// docs/learn.md, section 4.
Eigen::Vector3d project_arrow(const Eigen::Vector3d& arrow);

/// One use of a primitive by a track.
struct Coefficient {
  int primitive = 0;
  double value = 0.0;  ///< > 0
};

/// The result of dictionary learning.
struct Dictionary {
  std::vector<MotionPrimitive> primitives;
  std::vector<std::vector<Coefficient>> codes;  ///< per track, sorted by primitive
  std::vector<double> objective;                ///< after every step, with the price of each primitive: never increases
};

/// Learns local motion primitives by augmented semi-nonnegative sparse coding:
/// min 1/2 |X - D S|^2 + sparsity * sum S, S >= 0, each primitive in its convex set and support. Primitives are added
/// while each lowers the objective by more than `gain_cells`. `run_cells`: the longest path of a new primitive if
/// config.cut is first_unexplained. Source: Chen, Liu, How 2016 (ASNSC); docs/learn.md, sections 2 to 5. Differs:
/// support masks, see docs/decisions/0002-support-masks.md.
Dictionary learn_dictionary(std::span<const GridVector> tracks, const Grid& grid, double gain_cells, double run_cells,
                            const DictionaryConfig& config);

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
using ObservedTransitions = std::map<TransitionKey, ObservedTransition>;

/// Counts each transition at most once per trajectory and gathers the samples of both of its segments. A track of one
/// segment makes a self transition, so that its data are not lost. Shapes: `segments` has a list and `sites` the index
/// of a site for each track. Samples are measured velocities, slow ones included, so that fields show where people slow
/// down; of each stretch of a track one every `stride_s`, or all if that is 0. Source: SILA paper, T(i, j);
/// docs/learn.md, section 7.
ObservedTransitions observe_transitions(std::span<const CurbTrajectory> tracks,
                                        std::span<const std::vector<Segment>> segments, std::span<const int> sites,
                                        double stride_s = 0.0);

}  // namespace sila
