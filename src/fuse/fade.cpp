#include "sila/fuse/fade.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "sila/model/fading.hpp"

namespace sila {
namespace {

/// Never zero, so that what was seen long ago stays something that was seen.
double faded(double value, double share) {
  return std::max(value * share, std::numeric_limits<double>::min());
}

void fade_gp(SparseGp& gp, double share) {
  if (!(gp.points > 0.0)) return;
  const double points = faded(gp.points, share);
  gp = weighted(std::move(gp), share);
  gp.points = points;
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
  model.lessons = faded(std::move(model.lessons), share);
  return model;
}

}  // namespace sila
