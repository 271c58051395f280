#pragma once

#include <array>
#include <cstddef>
#include <iterator>
#include <vector>

#include "sila/predict/prediction.hpp"

namespace sila {

/// The position of a person at one time relative to that at t0: within 0.5 m, or farther in some direction.
enum class Outcome { stays, straight, left, right, back };
inline constexpr const char* kOutcomes[] = {"stays", "straight", "left", "right", "back"};
inline constexpr std::size_t kOutcomeCount = std::size(kOutcomes);

/// The probability of each outcome, at its index; the sum is 1.
using OutcomeProbabilities = std::array<double, kOutcomeCount>;

/// The outcome if the person is at this position [m]. Directions are relative to `prediction.heading`. `straight` is
/// within 25 degrees of it, or within 45 if the person stands; `back` is within 45 degrees of the opposite direction;
/// `left` and `right` are between. Throws: std::invalid_argument without a heading, and for a position that is not
/// finite.
Outcome outcome_of(const Prediction& prediction, const Vector2& position_m);

/// The probability of each outcome at a time of the prediction: the mass of the modes' density in it, by numerical
/// integration with an absolute error below 0.01. If the person stands and the probability p of having started is
/// known, `stays` is 1 - p, and the other outcomes are scaled to a sum of p. Throws: std::invalid_argument for a step
/// that the prediction does not have, or without a heading. Source: none in the paper; docs/decisions/0126-outcomes.md.
OutcomeProbabilities outcome_probabilities(const Prediction& prediction, std::size_t step);

/// For each mode, the probability that no other path of the prediction comes nearer to the true path, by the density of
/// the modes. (A weight is a share of that density: a mode with a small weight can often come nearest.) Of several
/// modes with the same path the first has its probability, the others 0; the sum is 1. Computed by numerical
/// integration with an absolute error below 0.04. Paths are compared halfway to the horizon and at the horizon. Source:
/// none in the paper; docs/decisions/0128-nearest-path.md.
std::vector<double> nearest_probabilities(const Prediction& prediction);

/// Steps at which outcomes are written: the last step until each whole second, and the last of all.
std::vector<std::size_t> outcome_steps(const Prediction& prediction);

}  // namespace sila
