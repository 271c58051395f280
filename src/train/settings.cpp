#include <cmath>
#include <stdexcept>
#include <string>

#include "refine/refine.hpp"
#include "sila/train/episode.hpp"

namespace sila {

ModelSettings settings_for(const Model& previous, const CurbFrame& frame, const EpisodeConfig& config) {
  validate(config);
  const bool metres = config.scaling == CurbScaling::metres;
  if (metres && frame.unit_m != Vector2::Ones()) {
    throw std::invalid_argument("run_episode: frame.unit_m = " + std::to_string(frame.unit_m.x()) +
                                ", with scaling = metres it must be 1; make the frame with that scaling");
  }
  require_separable("run_episode", previous, config.fuse.sites);
  const double width_m = config.reference_width_m > 0.0 ? config.reference_width_m : frame.sidewalk_width_m;
  const ModelSettings fresh = with_residuals(
      begin_settings(metres ? 1.0 : width_m, config.scaling, config.sampling.interval_s, config.learn.grid),
      config.predict.horizon_s, config.residual);
  if (previous.episodes == 0) return fresh;
  const ModelSettings& kept = previous.settings;
  if (fresh.scaling != kept.scaling)
    throw std::invalid_argument("run_episode: scaling is not the one that the model began with");
  if (fresh.sample_interval_s != kept.sample_interval_s) {
    throw std::invalid_argument("run_episode: sampling.interval_s = " + std::to_string(fresh.sample_interval_s) +
                                ", the model began with " + std::to_string(kept.sample_interval_s));
  }
  if (config.reference_width_m > 0.0 && config.reference_width_m != kept.reference_width_m) {
    throw std::invalid_argument("run_episode: reference_width_m = " + std::to_string(config.reference_width_m) +
                                ", the model began with " + std::to_string(kept.reference_width_m));
  }
  const double kept_cell_m = kept.grid.cell * kept.reference_width_m;
  if (std::abs(config.learn.grid.cell_m - kept_cell_m) > 1e-9 * kept_cell_m ||
      config.learn.grid.tile_cells != kept.grid.tile_cells) {
    throw std::invalid_argument(
        "run_episode: learn.grid is not the grid that the model began with (cell_m = " + std::to_string(kept_cell_m) +
        ", tile_cells = " + std::to_string(kept.grid.tile_cells) + ")");
  }
  if (fresh.residual_horizon_s != kept.residual_horizon_s || fresh.residual_knots != kept.residual_knots) {
    throw std::invalid_argument(
        "run_episode: residual GPs with " + std::to_string(fresh.residual_knots) + " knots until " +
        std::to_string(fresh.residual_horizon_s) + " s, the model began with " + std::to_string(kept.residual_knots) +
        " until " + std::to_string(kept.residual_horizon_s) + " s; keep residual.* and predict.horizon_s as they were");
  }
  return kept;
}

}  // namespace sila
