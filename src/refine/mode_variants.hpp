#pragma once

#include "predict/predict.hpp"
#include "refine/error_density.hpp"
#include "sila/refine/config.hpp"

namespace sila {

/// The covariances of a component about the mode's path, along and across the way from `start_m`.
void fill_covariances(Mode& mode, const ErrorDensity& density, std::size_t component, const Vector2& scale,
                      const Vector2& start_m);

/// Adds modes of little weight beside the first: slower, faster, more to the left, more to the right, each
/// `variant_reach` standard deviations off, so that a user of single paths sees what else may happen. In pairs, as
/// long as these and the wider modes do not exceed the maximum number of modes. Source: none in the paper;
/// docs/decisions/0072-mode_variants.md.
void add_variants(Workspace& workspace, const ErrorDensity& density, const Vector2& scale, const Vector2& start_m,
                  const RefineConfig& config);

/// Adds the wider components of the errors, about the path of the first mode.
void add_wide_modes(Workspace& workspace, const ErrorDensity& density, const Vector2& scale, const Vector2& start_m);

}  // namespace sila
