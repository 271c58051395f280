#include "predict/flow_field_index.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstdint>
#include <limits>
#include <utility>

#include "gp/earlier_gps.hpp"

namespace sila {
namespace {

/// Spatial hash: the plane is cut into square buckets of side `size`. Points over 2^31 buckets away share buckets with
/// others.
std::int64_t bucket_key(std::int64_t column, std::int64_t row) {
  return (column << 32) ^ (row & 0xffffffff);
}

std::int64_t bucket_column(double coordinate, double size) {
  constexpr double farthest = 9e18;  // limit of a 64-bit integer
  return static_cast<std::int64_t>(std::clamp(std::floor(coordinate / size), -farthest, farthest));
}

/// The middle of the bucket with this key, if no other bucket has the key.
Vector2 bucket_middle(std::int64_t key, double size) {
  const auto column = key >> 32, row = static_cast<std::int64_t>(static_cast<std::int32_t>(key));
  return size * (Vector2(static_cast<double>(column), static_cast<double>(row)) + Vector2::Constant(0.5));
}

/// A field of which one pseudo-input reaches over more buckets than this is evaluated everywhere, so that a small model
/// cannot make very many buckets.
constexpr double kMostBucketsReached = 1e3;
/// The bucket of fields that reach everywhere; they are entered in every other bucket as well. No position has this
/// key.
constexpr std::int64_t kEverywhere = std::numeric_limits<std::int64_t>::min();

/// A transition in a bucket where many overlap.
struct Ranked {
  double score = 0.0;
  int transition = 0;
};

/// Consecutive buckets of one column.
struct Stretch {
  std::int64_t column, first_row, last_row;
  auto operator<=>(const Stretch&) const = default;
};

/// Adds the buckets that have a point inside the ellipse with these half axes.
void add_stretches(const Vector2& centre, const Vector2& reach, double size, std::vector<Stretch>& stretches) {
  const std::int64_t last = bucket_column(centre.x() + reach.x(), size);
  for (std::int64_t column = bucket_column(centre.x() - reach.x(), size); column <= last; ++column) {
    const double left = static_cast<double>(column) * size;
    const double off = (std::clamp(centre.x(), left, left + size) - centre.x()) / reach.x();
    const double height = reach.y() * std::sqrt(std::max(0.0, 1.0 - off * off));
    stretches.push_back({column, bucket_column(centre.y() - height, size), bucket_column(centre.y() + height, size)});
  }
}

/// The buckets that a field may cover, in order, each once. One length scale away from a single pseudo-input the
/// variance of a field is above the support ratio. Between two pseudo-inputs it may be lower farther away; the index
/// may then miss the field, which is rare, as buckets are large.
std::vector<std::int64_t> buckets_of(const SparseGp& gp, double bucket_size) {
  const Vector2 reach(gp.kernel.length_scales(0), gp.kernel.length_scales(1));
  const Vector2 buckets_reached = 2.0 * reach / bucket_size + Vector2::Ones();  // along x and y, about
  if (!(buckets_reached.prod() <= kMostBucketsReached)) return {kEverywhere};
  std::vector<Stretch> stretches;
  for (Eigen::Index m = 0; m < gp.pseudo_inputs.cols(); ++m)
    add_stretches(gp.pseudo_inputs.col(m), reach, bucket_size, stretches);
  std::ranges::sort(stretches);
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

void sort_and_make_unique(std::vector<double>& values) {
  std::ranges::sort(values);
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

std::size_t index_of(const std::vector<double>& sorted, double value) {
  return static_cast<std::size_t>(std::ranges::lower_bound(sorted, value) - sorted.begin());
}

/// The points of a raster at which a field is summarised, and the summaries to fill.
struct CellSummaries {
  std::vector<RasterIndex> points;
  std::vector<FlowFieldIndex::CellSummary*> summaries;
};

void fill(const CellSummaries& summaries, const FlowFieldIndex::Field& field, const std::vector<double>& xs,
          const std::vector<double>& ys) {
  const double noise_variance = field.posterior.noise_variance().mean();
  const std::vector<FieldPrediction> flows = field.posterior.bounds(xs, ys, summaries.points);
  for (std::size_t i = 0; i < flows.size(); ++i) {
    const double variance = flows[i].variance.maxCoeff() + noise_variance;
    *summaries.summaries[i] = {flows[i].mean, 0.5 / variance, -std::log(variance)};
  }
}

}  // namespace

FlowFieldIndex::FlowFieldIndex(const Model& model, const PredictConfig& config, const Model* earlier,
                               const FlowFieldIndex* of_earlier)
    : sites_(model.sites), leaving_(model.primitives.size()) {
  bucket_size_ = model.settings.grid.cell;
  max_shortlisted_ = static_cast<std::size_t>(config.max_shortlisted);
  apart_ = model.sharing == SiteSharing::apart;
  buckets_.resize(apart_ ? sites_.size() : 1);
  std::vector<double> leaving_count(model.primitives.size(), 0.0);
  for (const Transition& transition : model.transitions)
    leaving_count[static_cast<std::size_t>(transition.from)] += transition.count;
  EarlierGps earlier_gps;
  for (std::size_t i = 0; earlier && i < earlier->transitions.size(); ++i)
    earlier_gps.add(earlier->transitions[i].field.gp, static_cast<int>(i));
  const auto posterior_of = [&](const FlowField& field) {
    const std::optional<int> same = earlier_gps.find(field.gp);
    if (same && earlier->transitions[static_cast<std::size_t>(*same)].field.gp_y == field.gp_y)
      return of_earlier->field(*same).posterior;
    return FlowPosterior(field.gp, field.second());
  };
  std::vector<std::optional<FlowPosterior>> posteriors(model.transitions.size());
  std::vector<std::vector<std::int64_t>> buckets(posteriors.size());
  tbb::parallel_for(std::size_t{0}, posteriors.size(), [&](std::size_t i) {
    const FlowField& field = model.transitions[i].field;
    posteriors[i] = posterior_of(field);
    buckets[i] = buckets_of(field.gp, bucket_size_);
  });
  fields_.reserve(posteriors.size());
  for (std::size_t i = 0; i < posteriors.size(); ++i) {
    const Transition& t = model.transitions[i];
    const auto from = static_cast<std::size_t>(t.from);
    fields_.push_back({t.from, t.to, t.count, t.count / leaving_count[from], *std::move(posteriors[i])});
    leaving_[from].push_back(static_cast<int>(i));
    add_transition(static_cast<int>(i), buckets[i], t.sites);
  }
  add_wide_fields();
  add_summaries();
}

void FlowFieldIndex::add_transition(int index, std::span<const std::int64_t> buckets,
                                    const std::vector<SiteCount>& sites) {
  const auto add_to = [&](Buckets& to) {
    for (const std::int64_t bucket : buckets) to[bucket].transitions.push_back(index);
  };
  if (!apart_) return add_to(buckets_.front());
  for (const SiteCount& part : sites) add_to(buckets_[static_cast<std::size_t>(part.site)]);
}

void FlowFieldIndex::add_wide_fields() {
  for (Buckets& buckets : buckets_) {
    const auto wide = buckets.find(kEverywhere);
    if (wide == buckets.end()) continue;
    for (auto& [key, bucket] : buckets) {
      if (key == kEverywhere) continue;
      std::vector<int>& all = bucket.transitions;
      all.insert(all.end(), wide->second.transitions.begin(), wide->second.transitions.end());
      std::ranges::sort(all);
    }
  }
}

void FlowFieldIndex::add_summaries() {
  std::vector<std::pair<Vector2, Bucket*>> crowded;
  std::vector<double> xs, ys;
  for (Buckets& buckets : buckets_) {
    for (auto& [key, bucket] : buckets) {
      if (bucket.transitions.size() <= max_shortlisted_) continue;
      const Vector2 middle = bucket_middle(key, bucket_size_);
      crowded.emplace_back(middle, &bucket);
      xs.push_back(middle.x());
      ys.push_back(middle.y());
    }
  }
  sort_and_make_unique(xs);
  sort_and_make_unique(ys);
  std::vector<CellSummaries> summaries(fields_.size());
  for (const auto& [middle, bucket] : crowded) {
    const RasterIndex point{index_of(xs, middle.x()), index_of(ys, middle.y())};
    bucket->summaries.resize(bucket->transitions.size());
    for (std::size_t k = 0; k < bucket->summaries.size(); ++k) {
      CellSummaries& of_field = summaries[static_cast<std::size_t>(bucket->transitions[k])];
      of_field.points.push_back(point);
      of_field.summaries.push_back(&bucket->summaries[k]);
    }
  }
  tbb::parallel_for(std::size_t{0}, fields_.size(), [&](std::size_t i) { fill(summaries[i], fields_[i], xs, ys); });
}

std::optional<int> FlowFieldIndex::site(const CurbFrame& frame) const {
  return find_site(sites_, frame);
}

const FlowFieldIndex::Bucket* FlowFieldIndex::bucket_at(const Vector2& position, std::optional<int> site) const {
  if ((apart_ && !site) || !(position.cwiseAbs().maxCoeff() < 1e9 * bucket_size_)) return nullptr;
  const Buckets& buckets = buckets_[apart_ ? static_cast<std::size_t>(*site) : 0];
  auto bucket =
      buckets.find(bucket_key(bucket_column(position.x(), bucket_size_), bucket_column(position.y(), bucket_size_)));
  if (bucket == buckets.end()) bucket = buckets.find(kEverywhere);
  return bucket == buckets.end() ? nullptr : &bucket->second;
}

std::span<const int> FlowFieldIndex::near(const CurbTrajectory& observed, std::optional<int> site,
                                          Scratch& scratch) const {
  const Bucket* bucket = bucket_at(observed.positions.back(), site);
  if (!bucket) return {};
  if (bucket->summaries.empty()) return bucket->transitions;
  const auto ranked = scratch.array<Ranked>(bucket->summaries.size());
  for (std::size_t k = 0; k < ranked.size(); ++k) {
    const CellSummary& summary = bucket->summaries[k];
    const double off = (observed.velocities.back() - summary.flow).squaredNorm();
    ranked[k] = {summary.log_scale - summary.half_precision * off, bucket->transitions[k]};
  }
  std::ranges::nth_element(ranked, ranked.begin() + static_cast<std::ptrdiff_t>(max_shortlisted_), {},
                           [](const Ranked& field) { return std::pair(-field.score, field.transition); });
  const auto most_likely = scratch.array<int>(max_shortlisted_);
  std::ranges::transform(ranked.first(max_shortlisted_), most_likely.begin(), &Ranked::transition);
  std::ranges::sort(most_likely);
  return most_likely;
}

}  // namespace sila
