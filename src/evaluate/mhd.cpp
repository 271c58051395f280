#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "sila/evaluate/metrics.hpp"

namespace sila {
namespace {

double mean_nearest_m(std::span<const Vector2> from, std::span<const Vector2> to) {
  double sum = 0.0;
  for (const Vector2& a : from) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vector2& b : to) nearest = std::min(nearest, (a - b).squaredNorm());
    sum += std::sqrt(nearest);
  }
  return sum / static_cast<double>(from.size());
}

}  // namespace

double modified_hausdorff_m(std::span<const Vector2> a, std::span<const Vector2> b) {
  if (a.empty() || b.empty()) throw std::invalid_argument("modified_hausdorff_m: a path is empty");
  return std::max(mean_nearest_m(a, b), mean_nearest_m(b, a));
}

}  // namespace sila
