#include "sila/predict/field_map.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "sila/core/buckets.hpp"

namespace sila {
namespace {

/// So many length scales from a pseudo-input it explains 1e-4 of what it explains of its own place, or less.
constexpr double kOutlookReach = 3.1;
/// The bucket of fields that reach everywhere; they stand in every other bucket as well. No place that is looked up has
/// this key.
constexpr std::int64_t kEverywhere = std::numeric_limits<std::int64_t>::min();

/// A field on its way into the map.
struct Entry {
  std::optional<FieldMap::Field> field;
  std::vector<std::int64_t> buckets;  ///< in which it may know something; in order, each once
};

/// Adds the buckets of which some point is within the ellipse with these half axes.
void add_buckets_within(const Vector2& centre, const Vector2& reach, double size, std::vector<std::int64_t>& buckets) {
  for_each_bucket(centre - reach, centre + reach, size, [&](std::int64_t key, const Vector2& corner) {
    const Vector2 nearest = centre.cwiseMax(corner).cwiseMin(corner + Vector2::Constant(size));
    if ((nearest - centre).cwiseQuotient(reach).squaredNorm() <= 1.0) buckets.push_back(key);
  });
}

/// One length scale away from all its pseudo-inputs a field knows less than the support ratio asks for.
std::vector<std::int64_t> buckets_of(const SparseGp& gp, double bucket_size) {
  const Vector2 reach(gp.kernel.length_scales(0), gp.kernel.length_scales(1));
  if (!(count_buckets(-reach, reach, bucket_size) <= kMostBuckets)) return {kEverywhere};
  std::vector<std::int64_t> buckets;
  for (Eigen::Index m = 0; m < gp.pseudo_inputs.cols(); ++m)
    add_buckets_within(gp.pseudo_inputs.col(m), reach, bucket_size, buckets);
  std::sort(buckets.begin(), buckets.end());
  buckets.erase(std::unique(buckets.begin(), buckets.end()), buckets.end());
  return buckets;
}

void add_outlook(const SparseGp& outlook, FieldMap::Field& field) {
  field.outlook.emplace(outlook);
  const Eigen::VectorXd reach = kOutlookReach * outlook.kernel.length_scales;
  field.outlook_reach = {outlook.pseudo_inputs.rowwise().minCoeff() - reach,
                         outlook.pseudo_inputs.rowwise().maxCoeff() + reach};
}

Entry entry_of(const Transition& transition, double leaving_count, double bucket_size) {
  const SparseGp& gp = transition.field.gp;
  Entry entry{FieldMap::Field{transition.from,
                              transition.to,
                              transition.count,
                              transition.count / leaving_count,
                              gp.kernel.signal_variance,
                              gp.noise_variance,
                              Posterior(gp),
                              {},
                              {}},
              buckets_of(gp, bucket_size)};
  if (transition.outlook.points > 0.0) add_outlook(transition.outlook, *entry.field);
  return entry;
}

}  // namespace

FieldMap::FieldMap(const Model& model) : leaving_(model.primitives.size()) {
  bucket_size_ = model.conventions.grid.cell;
  outlook_knots_ = model.conventions.outlook_knots, outlook_horizon_s_ = model.conventions.outlook_horizon_s;
  if (model.gait.points > 0.0) gait_.emplace(model.gait);
  places_ = model.places;
  std::vector<double> leaving_count(model.primitives.size(), 0.0);
  for (const Transition& transition : model.transitions)
    leaving_count[static_cast<std::size_t>(transition.from)] += transition.count;
  std::vector<Entry> entries(model.transitions.size());
  tbb::parallel_for(std::size_t{0}, entries.size(), [&](std::size_t i) {
    const Transition& transition = model.transitions[i];
    entries[i] = entry_of(transition, leaving_count[static_cast<std::size_t>(transition.from)], bucket_size_);
  });
  fields_.reserve(entries.size());
  for (Entry& entry : entries) {
    const int index = static_cast<int>(fields_.size());
    leaving_[static_cast<std::size_t>(entry.field->from)].push_back(index);
    for (const std::int64_t bucket : entry.buckets) buckets_[bucket].push_back(index);
    fields_.push_back(std::move(*entry.field));
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
