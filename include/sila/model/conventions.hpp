#pragma once

#include "sila/core/curb_frame.hpp"
#include "sila/core/grid.hpp"
#include "sila/gp/kernel.hpp"

namespace sila {

/// What must stay the same for the life of a model, or its parts could not be compared: fixed by its first episode.
struct Conventions {
  Grid grid;
  CurbScaling scaling = CurbScaling::mean_width;
  double sample_interval_s = 0.2;
  double reference_width_m =
      1.0;  ///< sidewalk width of the place where the model began; its configured metres became widths by it
  double outlook_horizon_s = 0.0;  ///< how far outlooks reach; 0 if the model has none
  int outlook_knots = 0;           ///< evenly spaced times until then
};

bool operator==(const Conventions& a, const Conventions& b);

}  // namespace sila
