#include "sila/model/model.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "sila/core/fields.hpp"
#include "sila/model/gait.hpp"
#include "sila/model/outlook.hpp"

namespace sila {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("model: " + what);
}

void check_primitive(std::size_t index, const MotionPrimitive& primitive) {
  const std::string name = "primitive " + std::to_string(index);
  if (primitive.cells.empty()) refuse(name + " has no cell");
  if (!(primitive.weight > 0.0) || !std::isfinite(primitive.weight))
    refuse(name + " has a weight that is not positive");
  if (primitive.support < 0) refuse(name + " has a support below zero");
  for (std::size_t c = 0; c < primitive.cells.size(); ++c) {
    if (c > 0 && !(primitive.cells[c - 1].cell < primitive.cells[c].cell)) refuse(name + ": cells are not sorted");
    const CellKey& cell = primitive.cells[c].cell;
    if (std::abs(static_cast<double>(cell.x)) > kFarthestCell || std::abs(static_cast<double>(cell.y)) > kFarthestCell)
      refuse(name + " has a cell over 1e9 cells away");
    const double length = primitive.cells[c].velocity.norm();
    if (!(length > 0.0 && length <= 1.0 + 1e-9)) refuse(name + ": the length of an arrow is outside (0, 1]");
  }
}

/// Who predicts or fuses makes an index of where each field may be asked; its keys must not overflow.
void check_extent(const Grid& grid, const std::string& name, const FlowField& field) {
  Eigen::AlignedBox2d reach = field.extent;
  if (!reach.min().allFinite() || !reach.max().allFinite()) refuse(name + ": the extent is not finite");
  for (Eigen::Index m = 0; m < field.gp.pseudo_inputs.cols(); ++m) reach.extend(Vector2(field.gp.pseudo_inputs.col(m)));
  if (reach.isEmpty()) return;
  const Vector2 lengths = field.gp.kernel.length_scales;
  const Vector2 low = reach.min() - lengths, high = reach.max() + lengths;
  if (!(std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff()) <= kFarthestCell * grid.cell))
    refuse(name + ": the field is over 1e9 cells away");
}

void check_outlook(const Model& model, const std::string& name, const SparseGp& outlook) {
  if (outlook.points == 0.0) return;
  try {
    validate(outlook);
  } catch (const std::invalid_argument& error) {
    refuse(name + ": outlook: " + error.what());
  }
  if (outlook.pseudo_inputs.rows() != kOutlookInputs || outlook.mean.size() != 2 * model.conventions.outlook_knots) {
    refuse(name + ": the outlook is not a map from " + std::to_string(kOutlookInputs) +
           " inputs to 2 outputs for each of " + std::to_string(model.conventions.outlook_knots) + " knots");
  }
}

void check_conventions(const Conventions& conventions) {
  validate(conventions.grid);
  const auto require = [](const char* name, double value, const Range& range) {
    require_in_range("model", name, value, range);
  };
  require("sample_interval_s", conventions.sample_interval_s, {1e-3, 60.0});
  require("reference_width_m", conventions.reference_width_m, {1e-3, 1e6});
  require("outlook_horizon_s", conventions.outlook_horizon_s, {0.0, 3600.0});
  require("outlook_knots", conventions.outlook_knots, {0, 1000});
  if ((conventions.outlook_knots > 0) != (conventions.outlook_horizon_s > 0.0))
    refuse("outlooks have knots without a horizon, or none until theirs");
}

void check_gait(const Model& model) {
  if (model.gait.points == 0.0) return;
  validate(model.gait);
  if (model.gait.pseudo_inputs.rows() != kGaitInputs || model.gait.mean.size() != 2 * model.conventions.outlook_knots)
    refuse("the gait is not a map from " + std::to_string(kGaitInputs) + " inputs to 2 outputs for each knot");
}

void check_transition(const Model& model, std::size_t index) {
  const Transition& transition = model.transitions[index];
  const std::string name = "transition " + std::to_string(transition.from) + " -> " + std::to_string(transition.to);
  const int primitives = static_cast<int>(model.primitives.size());
  if (transition.from < 0 || transition.to < 0 || transition.from >= primitives || transition.to >= primitives) {
    refuse(name + ": there are only " + std::to_string(primitives) + " primitives");
  }
  if (!(transition.count > 0.0) || !std::isfinite(transition.count)) refuse(name + ": the count is not positive");
  if (transition.support < 0) refuse(name + " has a support below zero");
  if (transition.last_episode < 0 || transition.last_episode > model.episodes) {
    refuse(name + ": last seen in episode " + std::to_string(transition.last_episode) + " of " +
           std::to_string(model.episodes));
  }
  if (index > 0) {
    const Transition& before = model.transitions[index - 1];
    if (std::pair(before.from, before.to) >= std::pair(transition.from, transition.to)) {
      refuse(name + " is out of order or stands twice");
    }
  }
  try {
    validate(transition.field.gp);
  } catch (const std::invalid_argument& error) {
    refuse(name + ": " + error.what());
  }
  if (transition.field.gp.pseudo_inputs.rows() != 2 || transition.field.gp.mean.size() != 2) {
    refuse(name + ": the field is not a map from 2 inputs to 2 outputs");
  }
  check_extent(model.conventions.grid, name, transition.field);
  check_outlook(model, name, transition.outlook);
}

}  // namespace

bool operator==(const Conventions& a, const Conventions& b) {
  return a.grid == b.grid && a.scaling == b.scaling && a.sample_interval_s == b.sample_interval_s &&
         a.reference_width_m == b.reference_width_m && a.outlook_horizon_s == b.outlook_horizon_s &&
         a.outlook_knots == b.outlook_knots;
}

std::size_t size(const Model& model) {
  return model.primitives.size() + model.transitions.size();
}

void check(const Model& model) {
  check_conventions(model.conventions);
  if (model.episodes < 0 || model.tracks < 0) refuse("it has fewer than no episodes or tracks");
  validate(model.lessons);
  for (std::size_t i = 0; i < model.primitives.size(); ++i) check_primitive(i, model.primitives[i]);
  for (std::size_t i = 0; i < model.transitions.size(); ++i) check_transition(model, i);
  check_gait(model);
  for (const CurbFrame& place : model.places) validate(place);
  for (std::size_t i = 1; i < model.episode_ids.size(); ++i) {
    if (!(model.episode_ids[i - 1] < model.episode_ids[i])) refuse("episode_ids are out of order or stand twice");
  }
}

}  // namespace sila
