#include "refine/forgetting.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include "core/concatenate.hpp"

namespace sila {
namespace {

/// Never zero, so that a transition observed long ago remains one.
double discounted(double value, double factor) {
  return std::max(value * factor, std::numeric_limits<double>::min());
}

void discount_gp(SparseGp& gp, double factor) {
  if (!(gp.points > 0.0)) return;
  const double points = discounted(gp.points, factor);
  gp = discount(std::move(gp), factor);
  gp.points = points;
}

/// The factor of a sum if only a part of it is discounted.
double factor_of_whole(double factor, double part, double whole) {
  return part > 0.0 ? 1.0 - (1.0 - factor) * std::min(1.0, part / whole) : 1.0;
}

}  // namespace

Model discount_model(Model model, double factor, std::span<const int> sites) {
  if (!(factor > 0.0 && factor <= 1.0)) {
    throw std::invalid_argument(concatenate("discount_model: factor = ", factor, " is outside (0, 1]"));
  }
  if (factor == 1.0) return model;
  const auto affected = [&](int site) { return std::ranges::find(sites, site) != sites.end(); };
  for (Transition& transition : model.transitions) {
    double of_these = 0.0;
    for (SiteCount& part : transition.sites) {
      if (!affected(part.site)) continue;
      of_these += part.count;
      part.count = discounted(part.count, factor);
    }
    const double left = factor_of_whole(factor, of_these, transition.count);
    if (left == 1.0) continue;
    transition.count = total_count(transition.sites);
    discount_gp(transition.field.gp, left);
    discount_gp(transition.field.gp_y, left);
    discount_gp(transition.residual, left);
  }
  for (std::size_t i = 0; i < model.sites.size(); ++i) {
    ErrorStatistics& of_site = model.sites[i].error_statistics;
    if (affected(static_cast<int>(i))) of_site = discounted(std::move(of_site), factor);
  }
  return model;
}

}  // namespace sila
