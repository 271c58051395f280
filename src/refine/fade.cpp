#include "sila/refine/fade.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace sila {
namespace {

/// Never zero, so that what was seen long ago stays something that was seen.
double faded(double value, double share) {
  return std::max(value * share, std::numeric_limits<double>::min());
}

void fade_gp(SparseGp& gp, double share) {
  if (!(gp.points > 0.0)) return;
  const double points = faded(gp.points, share);
  gp = discount(std::move(gp), share);
  gp.points = points;
}

/// What is left of a whole of which a part fades.
double part_left(double share, double part, double whole) {
  return part > 0.0 ? 1.0 - (1.0 - share) * std::min(1.0, part / whole) : 1.0;
}

}  // namespace

Model fade(Model model, double share, std::span<const int> sites) {
  if (!(share > 0.0 && share <= 1.0)) {
    throw std::invalid_argument("fade: share = " + std::to_string(share) + " is outside (0, 1]");
  }
  if (share == 1.0) return model;
  const auto fades = [&](int site) { return std::ranges::find(sites, site) != sites.end(); };
  for (Transition& transition : model.transitions) {
    double of_these = 0.0;
    for (SiteCount& part : transition.sites) {
      if (!fades(part.site)) continue;
      of_these += part.count;
      part.count = faded(part.count, share);
    }
    const double left = part_left(share, of_these, transition.count);
    if (left == 1.0) continue;
    transition.count = total_count(transition.sites);
    fade_gp(transition.field.gp, left);
    fade_gp(transition.field.gp_y, left);
    fade_gp(transition.residual, left);
  }
  double tracks = 0.0, all_tracks = 0.0;
  for (std::size_t i = 0; i < model.sites.size(); ++i) {
    Site& site = model.sites[i];
    all_tracks += static_cast<double>(site.tracks);
    if (!fades(static_cast<int>(i))) continue;
    tracks += static_cast<double>(site.tracks);
    site.error_statistics = faded(std::move(site.error_statistics), share);
    fade_gp(site.global_residual, share);
  }
  fade_gp(model.global_residual, part_left(share, tracks, all_tracks));
  return model;
}

}  // namespace sila
