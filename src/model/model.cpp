#include "sila/model/model.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/concatenate.hpp"
#include "sila/core/fields.hpp"

namespace sila {
namespace {

/// Sums of the same counts in different orders differ by less, relative to the sum.
constexpr double kCountRounding = 1e-9;

[[noreturn]] void reject(const auto&... parts) {
  throw invalid_argument("model: ", parts...);
}

void check_primitive(std::size_t index, const MotionPrimitive& primitive) {
  const std::string name = "primitive " + std::to_string(index);
  if (primitive.cells.empty()) reject(name, " has no cell");
  if (!(primitive.weight > 0.0) || !std::isfinite(primitive.weight)) reject(name, " has a weight that is not positive");
  if (primitive.support < 0) reject(name, " has a support below zero");
  for (std::size_t c = 0; c < primitive.cells.size(); ++c) {
    if (c > 0 && !(primitive.cells[c - 1].cell < primitive.cells[c].cell)) reject(name, ": cells are not sorted");
    const CellKey& cell = primitive.cells[c].cell;
    if (std::abs(static_cast<double>(cell.x)) > kFarthestCell || std::abs(static_cast<double>(cell.y)) > kFarthestCell)
      reject(name, " has a cell over 1e9 cells away");
    const double length = primitive.cells[c].velocity.norm();
    if (!(length > 0.0 && length <= 1.0 + 1e-9)) reject(name, ": the length of an arrow is outside (0, 1]");
  }
}

/// Prediction and fusion index where each field may be evaluated; the keys of that index must not overflow.
void check_extent(const Grid& grid, const std::string& name, const FlowField& field) {
  Eigen::AlignedBox2d reach = field.extent;
  if (!reach.min().allFinite() || !reach.max().allFinite()) reject(name, ": the extent is not finite");
  for (Eigen::Index m = 0; m < field.gp.pseudo_inputs.cols(); ++m) reach.extend(Vector2(field.gp.pseudo_inputs.col(m)));
  if (reach.isEmpty()) return;
  const Vector2 lengths = field.gp.kernel.length_scales;
  const Vector2 low = reach.min() - lengths, high = reach.max() + lengths;
  if (!(std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff()) <= kFarthestCell * grid.cell))
    reject(name, ": the field is over 1e9 cells away");
}

void check_gp(const std::string& name, const SparseGp& gp, Eigen::Index inputs, Eigen::Index outputs) {
  try {
    validate(gp);
  } catch (const std::invalid_argument& error) {
    reject(name, ": ", error.what());
  }
  if (gp.pseudo_inputs.rows() != inputs || gp.mean.size() != outputs)
    reject(name, " is not a map from ", inputs, " inputs to ", outputs, " outputs");
}

void check_settings(const ModelSettings& settings) {
  validate(settings.grid);
  require_in_range("model", "sample_interval_s", settings.sample_interval_s, {1e-3, 60.0});
  require_in_range("model", "reference_width_m", settings.reference_width_m, {1e-3, 1e6});
}

void check_site_counts(const Model& model, const std::string& name, const Transition& transition) {
  int before = -1;
  for (const auto& [site, count, last_episode] : transition.sites) {
    if (site <= before || site >= static_cast<int>(model.sites.size()))
      reject(name, ": sites are out of order, or there are only ", model.sites.size());
    if (!(count > 0.0) || !std::isfinite(count)) reject(name, ": the count of a site is not positive");
    const int episodes = model.sites[static_cast<std::size_t>(site)].episodes;
    if (last_episode < 0 || last_episode > episodes)
      reject(name, ": last seen in episode ", last_episode, " of ", episodes);
    before = site;
  }
  if (!(std::abs(total_count(transition.sites) - transition.count) <= kCountRounding * transition.count))
    reject(name, ": the counts of its sites do not add up to its count");
  if (model.sharing == SiteSharing::apart && transition.sites.size() > 1)
    reject(name, ": it is of several sites, which are apart");
}

void check_site(const Model& model, std::size_t index) {
  const Site& site = model.sites[index];
  validate(site.frame);
  if (site.episodes < 0 || site.tracks < 0) reject("site ", index, " has fewer than no episodes or tracks");
}

void check_transition(const Model& model, std::size_t index) {
  const Transition& transition = model.transitions[index];
  const std::string name = "transition " + std::to_string(transition.from) + " -> " + std::to_string(transition.to);
  const int primitives = static_cast<int>(model.primitives.size());
  if (transition.from < 0 || transition.to < 0 || transition.from >= primitives || transition.to >= primitives)
    reject(name, ": there are only ", primitives, " primitives");
  if (!(transition.count > 0.0) || !std::isfinite(transition.count)) reject(name, ": the count is not positive");
  if (transition.support < 0) reject(name, " has a support below zero");
  check_site_counts(model, name, transition);
  if (index > 0) {
    const Transition& before = model.transitions[index - 1];
    if (std::pair(before.from, before.to) >= std::pair(transition.from, transition.to))
      reject(name, " is out of order or stands twice");
  }
  const FlowField& field = transition.field;
  for (const SparseGp* gp : {&field.gp, field.second()}) {
    if (gp) check_gp(name + ": a GP of the field", *gp, 2, field.independent() ? 1 : 2);
  }
  if (field.independent() != model.transitions.front().field.independent())
    reject(name, ": its outputs are independent or shared, unlike those of the first transition");
  check_extent(model.settings.grid, name, field);
  const SparseGp& residual = entry_of(model.refinement.residuals, index);
  if (residual.points == 0.0) return;
  if (residual.pseudo_inputs.cols() == 0) reject(name, ": the residual GP has points, but no pseudo-input");
  check_gp(name + ": the residual GP", residual, kResidualInputs, 2 * model.refinement.residual_settings.knots);
}

/// All but the residual GPs, which are checked with their transitions.
void check_refinement(const Model& model) {
  const auto& [residual_settings, residuals, error_statistics, prior] = model.refinement;
  require_in_range("model", "residual_horizon_s", residual_settings.horizon_s, {0.0, 3600.0});
  require_in_range("model", "residual_knots", residual_settings.knots, {0, 1000});
  if ((residual_settings.knots > 0) != (residual_settings.horizon_s > 0.0))
    reject("residual GPs have knots without a horizon, or none until theirs");
  const auto fits = [](const auto& list, std::size_t size) { return list.empty() || list.size() == size; };
  if (!fits(residuals, model.transitions.size()) || !fits(error_statistics, model.sites.size()))
    reject("the refinement has not an entry for each transition or site");
  for (const ErrorStatistics& statistics : error_statistics) validate(statistics);
  require_one_shape(error_statistics);
  validate(prior);
  if (!error_statistics.empty()) require_like(prior, error_statistics.front());
}

}  // namespace

std::size_t size(const Model& model) {
  return model.primitives.size() + model.transitions.size();
}

void require_separable(const std::string& function, const Model& model, SiteSharing sharing) {
  if (sharing == SiteSharing::shared || model.sharing == SiteSharing::apart || model.sites.size() < 2) return;
  throw invalid_argument(function, ": fuse.sites = apart, but the model shares its ", model.sites.size(),
                         " sites, which cannot be parted; keep fuse.sites = shared, or learn it anew");
}

void check(const Model& model) {
  check_settings(model.settings);
  check_refinement(model);
  if (model.episodes < 0 || model.tracks < 0) reject("it has fewer than no episodes or tracks");
  for (std::size_t i = 0; i < model.sites.size(); ++i) check_site(model, i);
  for (std::size_t i = 0; i < model.primitives.size(); ++i) check_primitive(i, model.primitives[i]);
  for (std::size_t i = 0; i < model.transitions.size(); ++i) check_transition(model, i);
  for (std::size_t i = 1; i < model.episode_ids.size(); ++i) {
    if (!(model.episode_ids[i - 1] < model.episode_ids[i])) reject("episode_ids are out of order or stand twice");
  }
}

}  // namespace sila
