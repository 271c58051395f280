#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "core/concatenate.hpp"
#include "sila/core/sampling.hpp"
#include "sila/train/config.hpp"
#include "sila/train/episode.hpp"

namespace sila {
namespace {

/// Least width of a sidewalk: the coordinates of a model in widths must not become too large.
constexpr double kLeastWidth_m = 0.1;

/// Throws: std::invalid_argument unless a setting is what the model began with.
void require_kept(const char* setting, const auto& given, const auto& kept) {
  if (given == kept) return;
  throw invalid_argument(setting, " = ", given, ", but the model began with ", kept, "; keep it, or learn a new model");
}

/// The name of a choice of the configuration.
std::string name_of(std::span<const char* const> names, auto choice) {
  return names[static_cast<std::size_t>(choice)];
}

/// Throws: std::invalid_argument unless new errors can be added to the error statistics of the model.
void require_kept_statistics(const Model& model, const EpisodeConfig& config) {
  if (!config.error_statistics.enabled) return;
  const auto& [settings, residuals, error_statistics, prior] = model.refinement;
  const auto fitted = std::ranges::find_if_not(error_statistics, &ErrorStatistics::empty);
  const ErrorStatistics& kept = fitted == error_statistics.end() ? prior : *fitted;
  if (kept.empty()) return;
  require_kept("sampling.interval_s", config.sampling.interval_s, kept.interval_s);
  require_kept("predict.observe_s", config.predict.observe_s, kept.observe_s);
  const int steps = steps_in(config.predict.horizon_s, kept.interval_s);
  require_kept("predict.horizon_s in whole steps", kept.interval_s * steps, kept.interval_s * kept.steps);
}

}  // namespace

void require_same_units(const Model& model, const EpisodeConfig& config) {
  if (model.episodes == 0) return;
  require_kept("scaling", name_of(kCurbScalings, config.scaling), name_of(kCurbScalings, model.settings.scaling));
  require_kept("sampling.interval_s", config.sampling.interval_s, model.settings.sample_interval_s);
}

ModelSettings settings_for(const Model& previous, const CurbFrame& frame, const EpisodeConfig& config) {
  validate(config);
  const bool metres = config.scaling == CurbScaling::metres;
  if (metres && frame.unit_m != Vector2::Ones()) {
    throw invalid_argument("run_episode: frame.unit_m = ", frame.unit_m.x(),
                           ", with scaling = metres it must be 1; make the frame with that scaling");
  }
  require_separable("run_episode", previous, config.fuse.sites);
  const double width_m = config.reference_width_m > 0.0 ? config.reference_width_m : frame.sidewalk_width_m;
  const ModelSettings fresh =
      begin_settings(metres ? 1.0 : width_m, config.scaling, config.sampling.interval_s, config.learn.grid);
  require_kept_statistics(previous, config);
  if (previous.episodes == 0) return fresh;
  const ModelSettings& kept = previous.settings;
  require_same_units(previous, config);
  if (config.reference_width_m > 0.0)
    require_kept("reference_width_m", config.reference_width_m, kept.reference_width_m);
  const double cell_m = kept.grid.cell * kept.reference_width_m;
  const bool same_cell = std::abs(config.learn.grid.cell_m - cell_m) <= 1e-9 * cell_m;
  require_kept("learn.grid.cell_m", same_cell ? cell_m : config.learn.grid.cell_m, cell_m);
  if (!previous.transitions.empty()) {
    const bool independent = previous.transitions.front().field.independent();
    require_kept("learn.field.outputs", name_of(kFieldOutputs, config.learn.field.outputs),
                 name_of(kFieldOutputs, independent ? FieldOutputs::independent : FieldOutputs::shared));
  }
  require_kept("predict.horizon_s of residual GPs (0: residual.enabled = false)",
               config.residual.enabled ? config.predict.horizon_s : 0.0,
               previous.refinement.residual_settings.horizon_s);
  return kept;
}

void require_fitting(const Model& model, const EpisodeConfig& config) {
  settings_for(model, model.sites.empty() ? CurbFrame{} : model.sites.front().frame, config);
}

void validate(const EpisodeConfig& config) {
  validate_fields("config", config);
  const double width_m = config.reference_width_m;
  if (width_m > 0.0 && config.scaling == CurbScaling::metres) {
    throw invalid_argument("config: reference_width_m = ", width_m,
                           " has no meaning with scaling = metres; leave it 0, or choose scaling = "
                           "mean_width");
  }
  if (width_m > 0.0 && width_m < kLeastWidth_m)
    throw invalid_argument("config: reference_width_m = ", width_m, ", must be 0 or at least ", kLeastWidth_m);
}

}  // namespace sila
