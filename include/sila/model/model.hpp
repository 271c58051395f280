#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sila/model/episode_id.hpp"
#include "sila/model/motion_primitive.hpp"
#include "sila/model/settings.hpp"
#include "sila/model/site.hpp"
#include "sila/model/transition.hpp"

namespace sila {

/// What was learnt of one or several sites: M = {D, R}, and what past errors show. It holds no raw track.
/// Invariant: `check(model)` passes.
struct Model {
  ModelSettings settings;
  std::vector<MotionPrimitive> primitives;  ///< D
  std::vector<Transition> transitions;      ///< R, sorted by (from, to), each pair once
  std::vector<Site> sites;                  ///< where it was trained, in the order of training
  SiteSharing sharing = SiteSharing::apart;
  SparseGp global_residual;  ///< how walking goes on at all sites together, for others (global residual GP.hpp);
                             ///< constant size
  int episodes = 0;
  long tracks = 0;                     ///< trajectories learnt from
  std::vector<EpisodeId> episode_ids;  ///< what was learnt and must not be learnt again; sorted, each once

  bool empty() const { return primitives.empty(); }
};

/// The paper's model size: |D| + |R|.
std::size_t size(const Model& model);

/// Throws: std::invalid_argument if the sites of a model that shares them are to stay apart from now on.
void require_separable(const std::string& function, const Model& model, SiteSharing sharing);

/// Throws std::invalid_argument naming the first part that breaks an invariant: unsorted or repeated cells, arrows
/// longer than 1, transitions out of order, endpoints that do not exist, counts that are not positive, a GP with wrong
/// shapes or NaN, counts by site that do not add up or name no site, a transition of several sites though they are
/// apart.
void check(const Model& model);

}  // namespace sila
