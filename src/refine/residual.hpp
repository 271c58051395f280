#pragma once

#include <concepts>
#include <optional>
#include <span>

#include "sila/core/fields.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/gp/config.hpp"
#include "sila/gp/sparse_gp.hpp"
#include "sila/model/increment.hpp"
#include "sila/model/model.hpp"
#include "sila/refine/config.hpp"

namespace sila {

ResidualInput residual_input(const CurbTrajectory& observed);

/// The example of an observed path and its future (at the path's interval), if at least `min_seen_share` of the horizon
/// was seen; the last that was seen then stands for later knots. `settings` say where the knots are.
std::optional<ResidualSample> residual_sample(const CurbTrajectory& observed, std::span<const Vector2> future_m,
                                              const ModelSettings& settings, double min_seen_share);

Hyperparameters residual_hyperparameters(const ModelSettings& settings, const ResidualConfig& config);

/// How the sparse GPs of residual GPs are fitted and fused: their mean is zero, so that far from all examples constant
/// velocity is left.
GpConfig residual_gp_config(const ResidualConfig& config);

}  // namespace sila
