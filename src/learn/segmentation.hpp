#pragma once

#include <span>
#include <vector>

#include "learn/dictionary.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/learn/learn.hpp"

namespace sila {

/// Cuts a track into segments of the primitives that its code uses: the best labelling of all samples, where a label
/// scores coefficient * (arrow . heading) and each change of label costs a penalty. Samples without a heading
/// score nothing and take the label that suits their neighbours; short runs join the run before. Returns no segment if
/// the code uses no primitive enough. Neighbours differ. Source: docs/learn.md, section 6. Differs: a Viterbi pass
/// instead of sample-wise maxima; see docs/decisions/0003-segmentation.md.
std::vector<Segment> segment(const CurbTrajectory& track, std::span<const Coefficient> code,
                             std::span<const MotionPrimitive> primitives, const Grid& grid, double min_speed_mps);

}  // namespace sila
