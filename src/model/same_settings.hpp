#pragma once

#include <string>

#include "core/concatenate.hpp"
#include "sila/model/model.hpp"

namespace sila {

/// Throws: std::invalid_argument if any setting of two models differs; names them.
inline void require_same_settings(const std::string& function, const Model& model_a, const Model& model_b) {
  const ModelSettings &a = model_a.settings, &b = model_b.settings;
  const Refinement &ours_a = model_a.refinement, &ours_b = model_b.refinement;
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
  add("horizon of residual GPs [s]", ours_a.residual_settings.horizon_s, ours_b.residual_settings.horizon_s);
  add("knots of residual GPs", ours_a.residual_settings.knots, ours_b.residual_settings.knots);
  if (!text.empty())
    throw invalid_argument(function, ": the models have different settings: ", text, "; they must be equal");
}

}  // namespace sila
