#include "sila/predict/field_map.hpp"

#include <cmath>

namespace sila {
namespace {

std::int64_t pack(std::int64_t x, std::int64_t y) {
  return (x << 32) ^ (y & 0xffffffff);
}

std::int64_t floor_to(double value, double size) {
  return static_cast<std::int64_t>(std::floor(value / size));
}

}  // namespace

FieldMap::FieldMap(const Model& model) : leaving_(model.primitives.size()) {
  const Grid& grid = model.conventions.grid;
  bucket_size_ = 2.0 * grid.cell;
  outlook_knots_ = model.conventions.outlook_knots, outlook_horizon_s_ = model.conventions.outlook_horizon_s;
  if (model.gait.points > 0.0) gait_.emplace(model.gait);
  places_ = model.places;
  fields_.reserve(model.transitions.size());
  std::vector<double> leaving_count(model.primitives.size(), 0.0);
  for (const Transition& transition : model.transitions)
    leaving_count[static_cast<std::size_t>(transition.from)] += transition.count;
  for (const Transition& transition : model.transitions) {
    const int index = static_cast<int>(fields_.size());
    const SparseGp& gp = transition.field.gp;
    fields_.push_back({transition.from,
                       transition.to,
                       transition.count,
                       transition.count / leaving_count[static_cast<std::size_t>(transition.from)],
                       gp.kernel.signal_variance,
                       gp.noise_variance,
                       Posterior(gp),
                       {}});
    if (transition.outlook.points > 0.0) fields_.back().outlook.emplace(transition.outlook);
    leaving_[static_cast<std::size_t>(transition.from)].push_back(index);
    if (transition.field.extent.isEmpty()) continue;
    // One length scale beyond its data a field knows less than the support ratio asks for.
    const Vector2 reach(gp.kernel.length_scales(0), gp.kernel.length_scales(1));
    const Vector2 low = transition.field.extent.min() - reach, high = transition.field.extent.max() + reach;
    for (std::int64_t x = floor_to(low.x(), bucket_size_); x <= floor_to(high.x(), bucket_size_); ++x) {
      for (std::int64_t y = floor_to(low.y(), bucket_size_); y <= floor_to(high.y(), bucket_size_); ++y) {
        buckets_[pack(x, y)].push_back(index);
      }
    }
  }
}

std::int64_t FieldMap::bucket(const Vector2& position) const {
  return pack(floor_to(position.x(), bucket_size_), floor_to(position.y(), bucket_size_));
}

std::span<const int> FieldMap::near(const Vector2& position) const {
  if (!(position.cwiseAbs().maxCoeff() < 1e9 * bucket_size_)) return {};
  const auto place = buckets_.find(bucket(position));
  return place == buckets_.end() ? std::span<const int>() : std::span<const int>(place->second);
}

}  // namespace sila
