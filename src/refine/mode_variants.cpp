#include "refine/mode_variants.hpp"

#include <algorithm>
#include <cmath>

#include "core/kinematics.hpp"

namespace sila {
namespace {

Mode& add_twin(Workspace& workspace, VariantKind variant, double weight) {
  Mode& twin = add_mode(workspace, weight, workspace.prediction.times_s.size());
  const Mode& first = workspace.prediction.modes.front();
  twin.variant = variant, twin.source = first.source;
  twin.path_m = first.path_m, twin.covariances_m2 = first.covariances_m2, twin.primitives = first.primitives;
  return twin;
}

}  // namespace

void fill_covariances(Mode& mode, const ErrorDensity& density, std::size_t component, const Vector2& scale,
                      const Vector2& start_m) {
  for (std::size_t j = 0; j < mode.path_m.size(); ++j)
    mode.covariances_m2[j] = oriented_covariance(mode.path_m[j] - start_m, density.variances_m2(component, j, scale));
}

void add_variants(Workspace& workspace, const ErrorDensity& density, const Vector2& scale, const Vector2& start_m,
                  const RefineConfig& config) {
  struct Variant {
    VariantKind kind;
    Vector2 direction;  ///< along, across
  };
  static const Variant variants[] = {{VariantKind::slower, {-1.0, 0.0}},
                                     {VariantKind::faster, {1.0, 0.0}},
                                     {VariantKind::left, {0.0, 1.0}},
                                     {VariantKind::right, {0.0, -1.0}}};
  std::vector<Mode>& modes = workspace.prediction.modes;
  const int room = config.max_modes - (kMixtureComponents - 1) - static_cast<int>(modes.size());
  const int count = std::max(0, std::min(room, config.mode_variants) / 2 * 2);
  const double weight = config.variant_weight * modes.front().weight;
  for (int k = 0; k < count; ++k) {
    Mode& variant = add_twin(workspace, variants[k].kind, weight);
    for (std::size_t j = 0; j < variant.path_m.size(); ++j) {
      const Vector2 way = variant.path_m[j] - start_m;
      const double length = way.norm();
      const Vector2 ahead = length > 1e-9 ? Vector2(way / length) : Vector2(Vector2::UnitX());
      const Vector2 off = RefineConfig::variant_reach *
                          density.total_variances_m2(j, scale).cwiseSqrt().cwiseProduct(variants[k].direction);
      variant.path_m[j] += off.x() * ahead + off.y() * left_of(ahead);
    }
  }
  modes.front().weight -= count * weight;
}

void add_wide_modes(Workspace& workspace, const ErrorDensity& density, const Vector2& scale, const Vector2& start_m) {
  for (std::size_t component = 1; component < kMixtureComponents; ++component)
    fill_covariances(add_twin(workspace, VariantKind::wide, density.weight(component)), density, component, scale,
                     start_m);
}

}  // namespace sila
