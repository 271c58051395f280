#include "refine/mode_variants.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/kinematics.hpp"

namespace sila {
namespace {

/// Tilted weights keep the probability within reach at least this far from the least and the largest of a component.
constexpr double kLeastShare = 0.02;
/// Largest exponent of the tilt.
constexpr double kMostTilt = 30.0;
/// Share of the tilted weights in the result; the rest are those of the density, because the hazard may be wrong where
/// few people stood.
constexpr double kTiltedShare = 0.5;

/// Adds a mode with the path of the first one.
Mode& add_copy(Workspace& workspace, VariantKind variant, double weight) {
  Mode& copy = add_mode(workspace, weight);
  copy = workspace.prediction.modes.front();
  copy.weight = weight;
  copy.variant = variant;
  return copy;
}

VariantKind kind_of(const Vector2& direction) {
  if (std::abs(direction.x()) > std::abs(direction.y()))
    return direction.x() < 0.0 ? VariantKind::slower : VariantKind::faster;
  return direction.y() > 0.0 ? VariantKind::left : VariantKind::right;
}

}  // namespace

void fill_covariances(Mode& mode, const ErrorDensity& density, std::optional<std::size_t> component,
                      const ErrorScale& scale, const Vector2& start_m) {
  for (std::size_t j = 0; j < mode.path_m.size(); ++j) {
    const Vector2 variances_m2 =
        component ? density.variances_m2(*component, j, scale) : density.total_variances_m2(j, scale);
    mode.covariances_m2[j] = oriented_covariance(mode.path_m[j] - start_m, variances_m2);
  }
}

void add_variants(Workspace& workspace, const ErrorDensity& density, const ErrorScale& scale, const Vector2& start_m,
                  const RefineConfig& config) {
  std::vector<Mode>& modes = workspace.prediction.modes;
  const int room = config.max_modes - (kMixtureComponents - 1) - static_cast<int>(modes.size());
  const int count = std::min(room, config.mode_variants);
  if (count < 2) return;  // one alone would move the mean
  const double weight = config.variant_weight * modes.front().weight;
  for (int k = 0; k < count; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / count;
    Vector2 direction(-std::cos(angle), std::sin(angle));  // ahead, to the left of the person
    Mode& variant = add_copy(workspace, kind_of(direction), weight);
    if (workspace.prediction.mirrored) direction.y() = -direction.y();
    for (std::size_t j = 0; j < variant.path_m.size(); ++j) {
      const Vector2 ahead = unit_along(variant.path_m[j] - start_m);
      const Vector2 off = density.total_variances_m2(j, scale).cwiseSqrt().cwiseProduct(direction);
      variant.path_m[j] += off.x() * ahead + off.y() * left_of(ahead);
    }
  }
  modes.front().weight -= count * weight;
}

ComponentWeights standing_weights(const ErrorDensity& density, std::size_t step, const ErrorScale& scale,
                                  double stays) {
  // Probability of each component within reach, for a circular covariance of the same mean variance.
  ComponentWeights inside, weights;
  for (std::size_t c = 0; c < kMixtureComponents; ++c) {
    const double variance_m2 = density.variances_m2(c, step, scale).mean();
    inside[c] = 1.0 - std::exp(-0.5 * kStandingReach_m * kStandingReach_m / variance_m2);
  }
  const auto [least, most] = std::ranges::minmax(inside);
  const double low = least + kLeastShare, high = most - kLeastShare;
  if (!(low < high)) return scale.weights;
  const double wanted = std::clamp(stays, low, high);
  double from = -kMostTilt, to = kMostTilt;
  while (to - from > 1e-3) {
    const double tilt = 0.5 * (from + to);
    double sum = 0.0, within = 0.0;
    for (std::size_t c = 0; c < kMixtureComponents; ++c) {
      sum += weights[c] = scale.weights[c] * std::exp(tilt * inside[c]);
      within += weights[c] * inside[c];
    }
    for (double& weight : weights) weight /= sum;
    (within < wanted * sum ? from : to) = tilt;
  }
  for (std::size_t c = 0; c < kMixtureComponents; ++c)
    weights[c] = std::lerp(scale.weights[c], weights[c], kTiltedShare);
  return weights;
}

void add_wide_modes(Workspace& workspace, const ErrorDensity& density, const ComponentWeights& weights,
                    const ErrorScale& scale, const Vector2& start_m) {
  for (std::size_t component = 1; component < kMixtureComponents; ++component)
    fill_covariances(add_copy(workspace, VariantKind::wide, weights[component]), density, component, scale, start_m);
}

}  // namespace sila
