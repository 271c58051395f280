#pragma once

#include <type_traits>
#include <vector>

#include "sila/model/flow_field.hpp"
#include "sila/model/site.hpp"

namespace sila {

/// A transition between two primitives (or from one to itself): how often it was seen and how people move along it.
/// Count and field stand together so that the paper's R_edges and R_GP cannot disagree.
struct Transition {
  int from = 0;  ///< index of a primitive of the same model, 0-based
  int to = 0;
  double count = 0.0;  ///< trajectories that showed it, T(from, to)
  FlowField field;
  SparseGp residual = {};             ///< of the paths that led here (see residual GP.hpp); no points: nothing known
  std::vector<SiteCount> sites = {};  ///< `count` by site; sorted by site
  int support = 0;  ///< lower bound of the number of different tracks; is not discounted, counts no track twice
};

static_assert(std::is_nothrow_move_constructible_v<Transition>, "a list of transitions moves them where it grows");

}  // namespace sila
