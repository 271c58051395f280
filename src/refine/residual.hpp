#pragma once

#include <optional>
#include <span>

#include "sila/core/trajectory.hpp"
#include "sila/gp/sparse_gp.hpp"
#include "sila/model/increment.hpp"
#include "sila/model/model.hpp"
#include "sila/refine/config.hpp"

namespace sila {

/// The input of a residual GP at the end of an observed path.
ResidualInput residual_input(const CurbTrajectory& observed);

/// The sample of an observed path and its future (at the path's interval), if at least `min_seen_share` of the horizon
/// was seen; knots after the last seen position take the mean velocity until it. `settings` has the knots.
std::optional<ResidualSample> residual_sample(const CurbTrajectory& observed, std::span<const Vector2> future_m,
                                              const ModelSettings& settings, double min_seen_share);

/// Kernel and noise of residual GPs, in curb units.
Hyperparameters residual_hyperparameters(const ModelSettings& settings, const ResidualConfig& config);

/// Settings of residual GPs as sparse GPs. Their mean is zero, so that far from all samples the prediction is constant
/// velocity.
GpConfig residual_gp_config(const ResidualConfig& config);

}  // namespace sila
