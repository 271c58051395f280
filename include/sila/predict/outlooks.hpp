#pragma once

#include <span>

#include "sila/core/trajectory.hpp"
#include "sila/predict/field_map.hpp"
#include "sila/predict/scratch.hpp"

namespace sila {

/// How a path is expected to part from constant velocity.
struct Foresight {
  std::span<const Vector2> partings_mps;  ///< world frame, at each knot; none if the model has no outlooks
  double knot_interval_s = 1.0;
  double evidence = 0.0;  ///< how many people who came along alike it rests on

  /// Mean velocity from t0 to `seconds` later minus constant velocity [m/s]; between knots along a line, before the
  /// first and after the last as there.
  Vector2 parting_mps(double seconds) const;
};

/// What one transition's outlook says to somebody, ready to be added to what others say.
struct ExpertOpinion {
  int transition = 0;
  double gain = 0.0;                      ///< of precision, relative to the prior's
  double evidence = 0.0;                  ///< people who came along alike
  std::span<const double> weighted_mean;  ///< mean times relative precision, curb coordinates
};
/// Of the transitions nearby.
std::span<const ExpertOpinion> ask_outlooks(const FieldMap& map, std::span<const int> near,
                                            const CurbTrajectory& observed, Scratch& scratch);

/// Each transition nearby is an expert that saw other people: their precisions beyond the prior's add up, and each mean
/// counts by its precision. Those in `excluded` are not heard: they speak for another hypothesis.
/// Source: Tresp 2000, Bayesian committee machine; docs/decisions/0070-outlooks.md.
Foresight combine(const FieldMap& map, const CurbTrajectory& observed, std::span<const ExpertOpinion> opinions,
                  std::span<const int> excluded, Scratch& scratch);

/// What the gait says, whatever the place, at one where something was learnt or not.
Foresight consult_gait(const FieldMap& map, bool known_place, const CurbTrajectory& observed, Scratch& scratch);

}  // namespace sila
