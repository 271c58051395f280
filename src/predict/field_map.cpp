#include "sila/predict/field_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>

#include "sila/core/buckets.hpp"

namespace sila {
namespace {

/// So many length scales from a pseudo-input it explains 1e-4 of what it explains of its own place, or less.
constexpr double kOutlookReach = 3.1;
/// The bucket of fields that reach everywhere; they stand in every other bucket as well. No place that is looked up has
/// this key.
constexpr std::int64_t kEverywhere = std::numeric_limits<std::int64_t>::min();

/// The buckets of which some point is within the ellipse with these half axes.
void add_buckets_within(const Vector2& centre, const Vector2& reach, double size, std::set<std::int64_t>& buckets) {
  for_each_bucket(centre - reach, centre + reach, size, [&](std::int64_t key, const Vector2& corner) {
    const Vector2 nearest = centre.cwiseMax(corner).cwiseMin(corner + Vector2::Constant(size));
    if ((nearest - centre).cwiseQuotient(reach).squaredNorm() <= 1.0) buckets.insert(key);
  });
}

void add_outlook(const SparseGp& outlook, FieldMap::Field& field) {
  field.outlook.emplace(outlook);
  const Eigen::VectorXd reach = kOutlookReach * outlook.kernel.length_scales;
  field.outlook_reach = {outlook.pseudo_inputs.rowwise().minCoeff() - reach,
                         outlook.pseudo_inputs.rowwise().maxCoeff() + reach};
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
                       {},
                       {}});
    if (transition.outlook.points > 0.0) add_outlook(transition.outlook, fields_.back());
    leaving_[static_cast<std::size_t>(transition.from)].push_back(index);
    // One length scale away from all its pseudo-inputs a field knows less than the support ratio asks for.
    const Vector2 reach(gp.kernel.length_scales(0), gp.kernel.length_scales(1));
    if (!(count_buckets(-reach, reach, bucket_size_) <= kMostBuckets)) {
      buckets_[kEverywhere].push_back(index);
      continue;
    }
    std::set<std::int64_t> known;
    for (Eigen::Index m = 0; m < gp.pseudo_inputs.cols(); ++m)
      add_buckets_within(gp.pseudo_inputs.col(m), reach, bucket_size_, known);
    for (const std::int64_t bucket : known) buckets_[bucket].push_back(index);
  }
  const auto wide = buckets_.find(kEverywhere);
  if (wide == buckets_.end()) return;
  for (auto& [key, bucket] : buckets_) {
    if (key == kEverywhere) continue;
    bucket.insert(bucket.end(), wide->second.begin(), wide->second.end());
    std::sort(bucket.begin(), bucket.end());
  }
}

std::span<const int> FieldMap::near(const Vector2& position) const {
  if (!(position.cwiseAbs().maxCoeff() < 1e9 * bucket_size_)) return {};
  auto place = buckets_.find(bucket_of(position, bucket_size_));
  if (place == buckets_.end()) place = buckets_.find(kEverywhere);
  return place == buckets_.end() ? std::span<const int>() : std::span<const int>(place->second);
}

}  // namespace sila
