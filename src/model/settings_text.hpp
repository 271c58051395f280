#pragma once

#include <string>

#include "core/concatenate.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// The settings that differ, as "sampling.interval_s = 0.1 and 0.2, ..."; empty if none does.
inline std::string differences(const ModelSettings& a, const ModelSettings& b) {
  std::string text;
  const auto add = [&](const char* name, const auto& of_a, const auto& of_b) {
    if (!(of_a == of_b)) text += concatenate(text.empty() ? "" : ", ", name, " = ", of_a, " and ", of_b);
  };
  const auto name_of = [](CurbScaling scaling) { return kCurbScalings[static_cast<std::size_t>(scaling)]; };
  add("scaling", std::string(name_of(a.scaling)), std::string(name_of(b.scaling)));
  add("sampling.interval_s", a.sample_interval_s, b.sample_interval_s);
  add("reference_width_m", a.reference_width_m, b.reference_width_m);
  add("grid.cell", a.grid.cell, b.grid.cell);
  add("grid.origin.x", a.grid.origin.x(), b.grid.origin.x());
  add("grid.origin.y", a.grid.origin.y(), b.grid.origin.y());
  add("grid.tile_cells", a.grid.tile_cells, b.grid.tile_cells);
  add("horizon of residual GPs [s]", a.residual_horizon_s, b.residual_horizon_s);
  add("knots of residual GPs", a.residual_knots, b.residual_knots);
  return text;
}

}  // namespace sila
