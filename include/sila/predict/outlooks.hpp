#pragma once

#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/predict/field_map.hpp"

namespace sila {

/// How a path is expected to part from constant velocity.
struct Foresight {
  std::vector<Vector2> partings_mps;  ///< world frame, at each knot; none if the model has no outlooks
  double knot_interval_s = 1.0;
  double evidence = 0.0;  ///< how many people who came along alike it rests on

  /// Mean velocity from t0 to `seconds` later minus constant velocity [m/s]; between knots along a line, before the
  /// first and after the last as there.
  Vector2 parting_mps(double seconds) const;
};

/// Each transition nearby is an expert that saw other people: their precisions beyond the prior's add up, and each mean
/// counts by its precision. Source: Tresp 2000, Bayesian committee machine; docs/decisions/0060-outlooks.md.
Foresight consult_outlooks(const FieldMap& map, const CurbTrajectory& observed);

/// What the gait says, whatever the place.
Foresight consult_gait(const FieldMap& map, const CurbTrajectory& observed);

}  // namespace sila
