#pragma once

#include "sila/core/curb_frame.hpp"
#include "sila/core/grid.hpp"
#include "sila/gp/kernel.hpp"

namespace sila {

/// What must stay the same for the life of a model, or its parts could not be compared: fixed by its first episode.
struct ModelSettings {
  Grid grid;
  CurbScaling scaling = CurbScaling::metres;
  double sample_interval_s = 0.2;
  double reference_width_m = 1.0;   ///< [m] of one curb unit, by which configured metres became units
  double residual_horizon_s = 0.0;  ///< how far residual GPs reach; 0 if the model has none
  int residual_knots = 0;           ///< evenly spaced times until then
};

bool operator==(const ModelSettings& a, const ModelSettings& b);

}  // namespace sila
