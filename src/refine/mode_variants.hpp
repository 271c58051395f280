#pragma once

#include <cstddef>
#include <optional>

#include "predict/predict.hpp"
#include "refine/error_density.hpp"
#include "sila/refine/config.hpp"

namespace sila {

/// Sets the covariances of the mode to those of a component, or of all together, along and across the way from
/// `start_m`.
void fill_covariances(Mode& mode, const ErrorDensity& density, std::optional<std::size_t> component,
                      const ErrorScale& scale, const Vector2& start_m);

/// Adds modes of little weight around the first, so that a user of single paths sees other possible paths: the corners
/// of a regular polygon, one standard deviation away, the first one slower. As many as fit with the wide modes into
/// the maximum number of modes, but not one alone. Source: none in the paper; docs/decisions/0072-mode_variants.md.
void add_variants(Workspace& workspace, const ErrorDensity& density, const ErrorScale& scale, const Vector2& start_m,
                  const RefineConfig& config);

/// The weights for a standing person: the mean of the original and of the tilted weights of the density. Exponentially
/// tilted weights give the mixture at this step the probability `stays` within kStandingReach_m of
/// its mean, as far as its components allow. Source: none in the paper; docs/decisions/0126-outcomes.md.
ComponentWeights standing_weights(const ErrorDensity& density, std::size_t step, const ErrorScale& scale, double stays);

/// Adds the wider components of the errors, about the path of the first mode.
void add_wide_modes(Workspace& workspace, const ErrorDensity& density, const ComponentWeights& weights,
                    const ErrorScale& scale, const Vector2& start_m);

}  // namespace sila
