#pragma once

#include <cstddef>
#include <vector>

#include "sila/model/conventions.hpp"
#include "sila/model/episode_id.hpp"
#include "sila/model/lessons.hpp"
#include "sila/model/motion_primitive.hpp"
#include "sila/model/place.hpp"
#include "sila/model/transition.hpp"

namespace sila {

/// What was learnt of a place: M = {D, R}, and what past errors taught. It holds no raw track.
/// Invariant: `check(model)` passes.
struct Model {
  Conventions conventions;
  std::vector<MotionPrimitive> primitives;  ///< D
  std::vector<Transition> transitions;      ///< R, sorted by (from, to), each pair once
  Lessons lessons;                          ///< constant size
  SparseGp gait;                            ///< how walking goes on whatever the place (gait.hpp); constant size
  std::vector<CurbFrame> places;            ///< where it was learnt, in the order of learning
  int episodes = 0;
  long tracks = 0;                     ///< trajectories learnt from
  std::vector<EpisodeId> episode_ids;  ///< what was learnt and must not be learnt again; sorted, each once

  bool empty() const { return primitives.empty(); }
};

/// The paper's model size: |D| + |R|.
std::size_t size(const Model& model);

/// Throws std::invalid_argument naming the first part that breaks an invariant: unsorted or repeated cells, arrows
/// longer than 1, transitions out of order, endpoints that do not exist, counts that are not positive, a GP with wrong
/// shapes or NaN.
void check(const Model& model);

}  // namespace sila
