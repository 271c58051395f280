#pragma once

#include <span>

#include "sila/predict/predictor.hpp"

namespace sila {

/// An observed path and what came after it.
struct Window {
  CurbTrajectory observed;
  std::vector<Vector2> future_m;  ///< at the predictor's interval; may end before the horizon
};

/// What the predictor's errors on these windows teach. Prequential: the windows must be of tracks that its model has
/// not learnt.
Lessons gather_lessons(const Predictor& predictor, std::span<const Window> windows);

/// Past lessons, faded by `decay`, and new ones. Throws: std::invalid_argument if they differ in shape.
Lessons add_lessons(const Lessons& past, const Lessons& recent, double decay);

}  // namespace sila
