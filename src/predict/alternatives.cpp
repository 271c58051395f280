#include "sila/predict/alternatives.hpp"

#include <algorithm>
#include <cmath>

namespace sila {
namespace {

/// Ahead and to the left of somebody who goes this way; anything for somebody who stands.
Matrix2 heading_frame(const Vector2& way) {
  const double length = way.norm();
  const Vector2 ahead = length > 1e-9 ? Vector2(way / length) : Vector2(Vector2::UnitX());
  Matrix2 frame;
  frame << ahead, Vector2(-ahead.y(), ahead.x());
  return frame;
}

}  // namespace

std::vector<Mode> with_alternatives(const Mode& mode, const Vector2& start_m, int room, const PredictConfig& config) {
  constexpr Manner manners[] = {Manner::slower, Manner::faster, Manner::left, Manner::right};
  const int pairs = std::min(room, config.alternatives) / 2;
  std::vector<Mode> modes(static_cast<std::size_t>(1 + 2 * pairs), mode);
  if (pairs == 0) return modes;
  const double share = config.alternative_weight, reach = config.alternative_reach;
  modes.front().weight = mode.weight * (1.0 - 2.0 * pairs * share);
  for (std::size_t j = 0; j < mode.path_m.size(); ++j) {
    const Matrix2 frame = heading_frame(mode.path_m[j] - start_m);
    Matrix2 inner = frame.transpose() * mode.covariances_m2[j] * frame;
    for (int pair = 0; pair < pairs; ++pair) {
      const Vector2 off = reach * std::sqrt(inner(pair, pair)) * frame.col(pair);
      modes[static_cast<std::size_t>(1 + 2 * pair)].path_m[j] += pair == 0 ? Vector2(-off) : off;
      modes[static_cast<std::size_t>(2 + 2 * pair)].path_m[j] += pair == 0 ? off : Vector2(-off);
    }
    // What the offsets of a pair add to the variance, every member gives up.
    const double kept = 1.0 - 2.0 * share * reach * reach;
    for (int pair = 0; pair < pairs; ++pair) inner.row(pair) *= std::sqrt(kept), inner.col(pair) *= std::sqrt(kept);
    const Matrix2 covariance = frame * inner * frame.transpose();
    for (Mode& member : modes) member.covariances_m2[j] = 0.5 * (covariance + covariance.transpose());
  }
  for (std::size_t k = 1; k < modes.size(); ++k) {
    modes[k].weight = mode.weight * share;
    modes[k].manner = manners[k - 1];
  }
  return modes;
}

}  // namespace sila
