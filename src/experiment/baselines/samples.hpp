#pragma once

#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/predict/prediction.hpp"

namespace sila {

/// A prediction from weighted sample paths [m, world frame]: one mode a path, the heaviest first. Each is given the
/// covariance of a kernel density estimate (Scott's rule on the effective number of samples), as samples alone have no
/// density. Throws: std::invalid_argument for no path.
Prediction from_samples(double t0_s, double interval_s, std::vector<Mode> paths);

/// The baselines' answer where they know nothing: constant velocity, flagged as a fallback.
Prediction constant_fallback(const CurbTrajectory& observed, int steps, double interval_s);

}  // namespace sila
