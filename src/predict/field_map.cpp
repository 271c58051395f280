#include "sila/predict/field_map.hpp"

#include <cmath>
#include <set>

namespace sila {
namespace {

std::int64_t pack(std::int64_t x, std::int64_t y) {
  return (x << 32) ^ (y & 0xffffffff);
}

std::int64_t floor_to(double value, double size) {
  return static_cast<std::int64_t>(std::floor(value / size));
}

/// The buckets of which some point is within the ellipse with these half axes.
void add_buckets_within(const Vector2& centre, const Vector2& reach, double size, std::set<std::int64_t>& buckets) {
  const Vector2 low = centre - reach, high = centre + reach;
  for (std::int64_t x = floor_to(low.x(), size); x <= floor_to(high.x(), size); ++x) {
    for (std::int64_t y = floor_to(low.y(), size); y <= floor_to(high.y(), size); ++y) {
      const Vector2 corner(static_cast<double>(x) * size, static_cast<double>(y) * size);
      const Vector2 nearest = centre.cwiseMax(corner).cwiseMin(corner + Vector2::Constant(size));
      if ((nearest - centre).cwiseQuotient(reach).squaredNorm() <= 1.0) buckets.insert(pack(x, y));
    }
  }
}

}  // namespace

FieldMap::FieldMap(const Model& model) : leaving_(model.primitives.size()) {
  const Grid& grid = model.conventions.grid;
  bucket_size_ = grid.cell;
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
    // One length scale away from all its pseudo-inputs a field knows less than the support ratio asks for.
    const Vector2 reach(gp.kernel.length_scales(0), gp.kernel.length_scales(1));
    std::set<std::int64_t> known;
    for (Eigen::Index m = 0; m < gp.pseudo_inputs.cols(); ++m)
      add_buckets_within(gp.pseudo_inputs.col(m), reach, bucket_size_, known);
    for (const std::int64_t bucket : known) buckets_[bucket].push_back(index);
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
