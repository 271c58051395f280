#include "sila/predict/field_map.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "sila/core/buckets.hpp"
#include "sila/model/gait.hpp"

namespace sila {
namespace {

/// So many length scales from a pseudo-input it explains 1e-4 of what it explains of its own place, or less.
constexpr double kOutlookReach = 3.1;
/// A field of which one pseudo-input reaches over more buckets than this is asked everywhere instead: a model of few
/// bytes would else make very many buckets.
constexpr double kMostBucketsReached = 1e3;
/// The bucket of fields that reach everywhere; they stand in every other bucket as well. No place that is looked up has
/// this key.
constexpr std::int64_t kEverywhere = std::numeric_limits<std::int64_t>::min();

/// A field on its way into the map.
struct Entry {
  std::optional<FieldMap::Field> field;
  std::vector<std::int64_t> buckets;  ///< in which it may know something; in order, each once
};

/// A transition where many overlap.
struct Ranked {
  double score = 0.0;
  int transition = 0;
};

/// Buckets of one column, one above the other.
struct Stretch {
  std::int64_t column, first_row, last_row;
  bool operator<(const Stretch& other) const {
    return column != other.column ? column < other.column : first_row < other.first_row;
  }
};

/// Adds the buckets of which some point is within the ellipse with these half axes.
void add_stretches(const Vector2& centre, const Vector2& reach, double size, std::vector<Stretch>& stretches) {
  const std::int64_t last = bucket_column(centre.x() + reach.x(), size);
  for (std::int64_t column = bucket_column(centre.x() - reach.x(), size); column <= last; ++column) {
    const double left = static_cast<double>(column) * size;
    const double off = (std::clamp(centre.x(), left, left + size) - centre.x()) / reach.x();
    const double height = reach.y() * std::sqrt(std::max(0.0, 1.0 - off * off));
    stretches.push_back({column, bucket_column(centre.y() - height, size), bucket_column(centre.y() + height, size)});
  }
}

/// One length scale away from all its pseudo-inputs a field knows less than the support ratio asks for.
std::vector<std::int64_t> buckets_of(const SparseGp& gp, double bucket_size) {
  const Vector2 reach(gp.kernel.length_scales(0), gp.kernel.length_scales(1));
  if (!(count_buckets(-reach, reach, bucket_size) <= kMostBucketsReached)) return {kEverywhere};
  std::vector<Stretch> stretches;
  for (Eigen::Index m = 0; m < gp.pseudo_inputs.cols(); ++m)
    add_stretches(gp.pseudo_inputs.col(m), reach, bucket_size, stretches);
  std::sort(stretches.begin(), stretches.end());
  std::vector<std::int64_t> buckets;
  Stretch covered{std::numeric_limits<std::int64_t>::min(), 0, 0};
  for (const Stretch& stretch : stretches) {
    const std::int64_t next = stretch.column == covered.column ? covered.last_row + 1 : stretch.first_row;
    for (std::int64_t row = std::max(next, stretch.first_row); row <= stretch.last_row; ++row)
      buckets.push_back(bucket_key(stretch.column, row));
    covered = {stretch.column, stretch.first_row, std::max(stretch.last_row, next - 1)};
  }
  return buckets;
}

/// The transitions of an earlier model that may be those of this one.
class Known {
 public:
  explicit Known(const FieldMap::Made& earlier) : earlier_(earlier) {
    if (!earlier.model) return;
    for (std::size_t i = 0; i < earlier.model->transitions.size(); ++i)
      by_mark_.emplace(mark_of(earlier.model->transitions[i].field.gp), static_cast<int>(i));
  }

  Posterior field(const SparseGp& gp) const {
    for (const int index : marked(gp)) {
      if (transition(index).field.gp == gp) return earlier_.map->field(index).posterior;
    }
    return Posterior(gp);
  }

  /// An outlook stays with its field, if that stays.
  Posterior outlook(const SparseGp& field, const SparseGp& gp) const {
    for (const int index : marked(field)) {
      const std::optional<Posterior>& made = earlier_.map->field(index).outlook;
      if (made && transition(index).outlook == gp) return *made;
    }
    return Posterior(gp);
  }

 private:
  /// Other fields hardly ever have it.
  static double mark_of(const SparseGp& gp) { return gp.points + gp.mean_response.sum(); }

  const Transition& transition(int index) const { return earlier_.model->transitions[static_cast<std::size_t>(index)]; }

  std::vector<int> marked(const SparseGp& gp) const {
    std::vector<int> indices;
    const auto [first, last] = by_mark_.equal_range(mark_of(gp));
    std::transform(first, last, std::back_inserter(indices), [](const auto& entry) { return entry.second; });
    return indices;
  }

  FieldMap::Made earlier_;
  std::unordered_multimap<double, int> by_mark_;
};

void add_outlook(const SparseGp& outlook, Posterior posterior, FieldMap::Field& field) {
  field.outlook = std::move(posterior);
  const Eigen::VectorXd reach = kOutlookReach * outlook.kernel.length_scales;
  field.outlook_reach = {outlook.pseudo_inputs.rowwise().minCoeff() - reach,
                         outlook.pseudo_inputs.rowwise().maxCoeff() + reach};
}

Entry entry_of(const Transition& transition, const Known& known, double leaving_count, double bucket_size) {
  const SparseGp& gp = transition.field.gp;
  Entry entry{FieldMap::Field{transition.from,
                              transition.to,
                              transition.count,
                              transition.count / leaving_count,
                              gp.kernel.signal_variance,
                              gp.noise_variance,
                              known.field(gp),
                              {},
                              {}},
              buckets_of(gp, bucket_size)};
  if (transition.outlook.points > 0.0)
    add_outlook(transition.outlook, known.outlook(gp, transition.outlook), *entry.field);
  return entry;
}

void sort_and_make_unique(std::vector<double>& values) {
  std::ranges::sort(values);
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

std::size_t index_of(const std::vector<double>& sorted, double value) {
  return static_cast<std::size_t>(std::ranges::lower_bound(sorted, value) - sorted.begin());
}

/// Where a field is glanced at, and what takes up each glance.
struct Glances {
  std::vector<RasterPlace> places;
  std::vector<FieldMap::Glimpse*> glimpses;

  void reserve(std::size_t size) { places.reserve(size), glimpses.reserve(size); }
};

void take_up(const Glances& glances, const FieldMap::Field& field, const std::vector<double>& xs,
             const std::vector<double>& ys) {
  std::vector<FlowPrediction> flows(glances.places.size());
  field.posterior.glance_at_flow(xs, ys, glances.places, flows);
  for (std::size_t i = 0; i < flows.size(); ++i) {
    const double variance = flows[i].variance + field.noise_variance;
    *glances.glimpses[i] = {flows[i].mean, 0.5 / variance, -std::log(variance)};
  }
}

}  // namespace

FieldMap::FieldMap(const Model& model, const PredictConfig& config, const Made& earlier)
    : leaving_(model.primitives.size()) {
  bucket_size_ = model.conventions.grid.cell;
  max_asked_ = static_cast<std::size_t>(config.max_asked);
  outlook_knots_ = model.conventions.outlook_knots, outlook_horizon_s_ = model.conventions.outlook_horizon_s;
  if (model.gait.points > 0.0) {
    gait_.emplace(model.gait);
    gait_elsewhere_.emplace(gait_elsewhere(model.gait, config.gait_examples_elsewhere));
  }
  places_ = model.places;
  std::vector<double> leaving_count(model.primitives.size(), 0.0);
  for (const Transition& transition : model.transitions)
    leaving_count[static_cast<std::size_t>(transition.from)] += transition.count;
  const Known known(earlier);
  std::vector<Entry> entries(model.transitions.size());
  tbb::parallel_for(std::size_t{0}, entries.size(), [&](std::size_t i) {
    const Transition& transition = model.transitions[i];
    entries[i] = entry_of(transition, known, leaving_count[static_cast<std::size_t>(transition.from)], bucket_size_);
  });
  fields_.reserve(entries.size());
  for (Entry& entry : entries) {
    const int index = static_cast<int>(fields_.size());
    leaving_[static_cast<std::size_t>(entry.field->from)].push_back(index);
    for (const std::int64_t bucket : entry.buckets) buckets_[bucket].transitions.push_back(index);
    fields_.push_back(std::move(*entry.field));
  }
  add_wide_fields();
  add_glimpses();
}

void FieldMap::add_wide_fields() {
  const auto wide = buckets_.find(kEverywhere);
  if (wide == buckets_.end()) return;
  for (auto& [key, bucket] : buckets_) {
    if (key == kEverywhere) continue;
    std::vector<int>& all = bucket.transitions;
    all.insert(all.end(), wide->second.transitions.begin(), wide->second.transitions.end());
    std::sort(all.begin(), all.end());
  }
}

void FieldMap::add_glimpses() {
  std::vector<std::pair<Vector2, Bucket*>> crowded;
  std::vector<double> xs, ys;
  for (auto& [key, bucket] : buckets_) {
    if (bucket.transitions.size() <= max_asked_) continue;
    const Vector2 middle = bucket_middle(key, bucket_size_);
    crowded.emplace_back(middle, &bucket);
    xs.push_back(middle.x()), ys.push_back(middle.y());
  }
  sort_and_make_unique(xs), sort_and_make_unique(ys);
  std::vector<Glances> glances(fields_.size());
  std::vector<std::size_t> times_glanced(fields_.size());
  for (const auto& [middle, bucket] : crowded) {
    for (const int transition : bucket->transitions) ++times_glanced[static_cast<std::size_t>(transition)];
  }
  for (std::size_t i = 0; i < fields_.size(); ++i) glances[i].reserve(times_glanced[i]);
  for (const auto& [middle, bucket] : crowded) {
    const RasterPlace place{index_of(xs, middle.x()), index_of(ys, middle.y())};
    bucket->glimpses.resize(bucket->transitions.size());
    for (std::size_t k = 0; k < bucket->glimpses.size(); ++k) {
      Glances& of_field = glances[static_cast<std::size_t>(bucket->transitions[k])];
      of_field.places.push_back(place), of_field.glimpses.push_back(&bucket->glimpses[k]);
    }
  }
  tbb::parallel_for(std::size_t{0}, fields_.size(), [&](std::size_t i) { take_up(glances[i], fields_[i], xs, ys); });
}

const FieldMap::Bucket* FieldMap::bucket_at(const Vector2& position) const {
  if (!(position.cwiseAbs().maxCoeff() < 1e9 * bucket_size_)) return nullptr;
  auto place = buckets_.find(bucket_of(position, bucket_size_));
  if (place == buckets_.end()) place = buckets_.find(kEverywhere);
  return place == buckets_.end() ? nullptr : &place->second;
}

std::span<const int> FieldMap::near(const CurbTrajectory& observed, Scratch& scratch) const {
  const Bucket* bucket = observed.positions.empty() ? nullptr : bucket_at(observed.positions.back());
  if (!bucket) return {};
  if (bucket->glimpses.empty()) return bucket->transitions;
  const auto ranked = scratch.array<Ranked>(bucket->glimpses.size());
  for (std::size_t k = 0; k < ranked.size(); ++k) {
    const Glimpse& glimpse = bucket->glimpses[k];
    const double off = (observed.velocities.back() - glimpse.flow).squaredNorm();
    ranked[k] = {glimpse.log_scale - glimpse.half_precision * off, bucket->transitions[k]};
  }
  std::nth_element(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(max_asked_), ranked.end(),
                   [](const Ranked& a, const Ranked& b) {
                     return a.score != b.score ? a.score > b.score : a.transition < b.transition;
                   });
  const auto likeliest = scratch.array<int>(max_asked_);
  std::ranges::transform(ranked.first(max_asked_), likeliest.begin(), &Ranked::transition);
  std::ranges::sort(likeliest);
  return likeliest;
}

}  // namespace sila
