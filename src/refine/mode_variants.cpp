#include "sila/refine/mode_variants.hpp"

#include <algorithm>
#include <cmath>

namespace sila {
namespace {

/// Ahead and to the left of a pedestrian who goes this way; anything for a pedestrian who stands.
Matrix2 heading_frame(const Vector2& way) {
  const double length = way.norm();
  const Vector2 ahead = length > 1e-9 ? Vector2(way / length) : Vector2(Vector2::UnitX());
  Matrix2 frame;
  frame << ahead, Vector2(-ahead.y(), ahead.x());
  return frame;
}

}  // namespace

int count_variants(int room, const PredictConfig& config) {
  return std::max(0, std::min(room, config.mode_variants) / 2 * 2);
}

void split_into_variants(std::span<Mode> modes, const Vector2& start_m, const PredictConfig& config) {
  constexpr VariantKind variants[] = {VariantKind::slower, VariantKind::faster, VariantKind::left, VariantKind::right};
  const std::size_t pairs = modes.size() / 2;
  Mode& most_likely = modes.front();
  const double share = config.variant_weight, reach = config.variant_reach;
  for (std::size_t k = 1; k < modes.size(); ++k) {
    modes[k] = most_likely;
    modes[k].weight = most_likely.weight * share;
    modes[k].variant = variants[k - 1];
  }
  most_likely.weight *= 1.0 - 2.0 * static_cast<double>(pairs) * share;
  for (std::size_t j = 0; j < most_likely.path_m.size(); ++j) {
    const Matrix2 frame = heading_frame(most_likely.path_m[j] - start_m);
    Matrix2 inner = frame.transpose() * most_likely.covariances_m2[j] * frame;
    for (std::size_t pair = 0; pair < pairs; ++pair) {
      const auto axis = static_cast<Eigen::Index>(pair);
      const Vector2 off = reach * std::sqrt(inner(axis, axis)) * frame.col(axis);
      modes[1 + 2 * pair].path_m[j] += pair == 0 ? Vector2(-off) : off;
      modes[2 + 2 * pair].path_m[j] += pair == 0 ? off : Vector2(-off);
    }
    // What the offsets of a pair add to the variance, every member gives up.
    const double kept = std::sqrt(1.0 - 2.0 * share * reach * reach);
    for (Eigen::Index axis = 0; axis < static_cast<Eigen::Index>(pairs); ++axis) {
      inner.row(axis) *= kept;
      inner.col(axis) *= kept;
    }
    const Matrix2 covariance = frame * inner * frame.transpose();
    for (Mode& member : modes) member.covariances_m2[j] = 0.5 * (covariance + covariance.transpose());
  }
}

}  // namespace sila
