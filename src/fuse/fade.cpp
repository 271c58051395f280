#include "sila/fuse/fade.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

namespace sila {
namespace {

/// Never zero, so that what was seen long ago stays something that was seen.
double faded(double value, double share) {
  return std::max(value * share, std::numeric_limits<double>::min());
}

/// The statistics are sums over data points, so that weighting every point is a factor.
void fade_gp(SparseGp& gp, double share) {
  if (!(gp.points > 0.0)) return;
  gp.information *= share;
  gp.response *= share;
  gp.mean_response *= share;
  gp.points = faded(gp.points, share);
}

void fade_lessons(Lessons& lessons, double share) {
  for (auto* table : {&lessons.with_map, &lessons.without_map}) {
    for (RegressionMoments& moments : *table) {
      moments.weight *= share;
      moments.features *= share;
      moments.products *= share;
    }
  }
  for (auto* table : {&lessons.residuals_with_map, &lessons.residuals_without_map, &lessons.residuals_place_free}) {
    for (ResidualMoments& moments : *table) {
      moments.weight *= share;
      moments.along_m2 *= share;
      moments.across_m2 *= share;
    }
  }
  for (std::vector<double>& bins : lessons.surprises) {
    for (double& bin : bins) bin *= share;
  }
  for (double& bin : lessons.novelties) bin *= share;
}

}  // namespace

Model fade(Model model, double share) {
  if (!(share > 0.0 && share <= 1.0)) {
    throw std::invalid_argument("fade: share = " + std::to_string(share) + " is outside (0, 1]");
  }
  if (share == 1.0) return model;
  for (Transition& transition : model.transitions) {
    transition.count = faded(transition.count, share);
    fade_gp(transition.field.gp, share);
    fade_gp(transition.outlook, share);
  }
  fade_gp(model.gait, share);
  fade_lessons(model.lessons, share);
  return model;
}

}  // namespace sila
