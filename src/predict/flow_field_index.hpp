#pragma once

#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "gp/flow_posterior.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/model/model.hpp"
#include "sila/predict/config.hpp"
#include "sila/predict/prediction.hpp"

namespace sila {

/// The flow fields of a model, prepared once for many predictions: factorised fields, a spatial index over them, and
/// the graph of primitives.
class FlowFieldIndex {
 public:
  /// Posteriors of fields that are equal in an earlier model are taken from its index.
  FlowFieldIndex(const Model& model, const PredictConfig& config, const Model* earlier = nullptr,
                 const FlowFieldIndex* of_earlier = nullptr);

  struct Field {
    int from = 0, to = 0;
    double count = 0.0;
    double probability = 0.0;  ///< P(to | from)
    FlowPosterior posterior;   ///< variances [curb units²/s²]
  };

  const Field& field(int transition) const { return fields_[static_cast<std::size_t>(transition)]; }
  /// The trained site of this frame; null at an untrained site.
  std::optional<int> site(const CurbFrame& frame) const;
  /// Transitions whose field may cover the current position, in order. If sites are apart: those of this site; at an
  /// untrained site none. Where more than `max_shortlisted` overlap, those whose flow in the middle of the bucket best
  /// matches the current velocity.
  std::span<const int> near(const CurbTrajectory& observed, std::optional<int> site, Scratch& scratch) const;
  /// Transitions that leave a primitive, in order.
  std::span<const int> leaving(int primitive) const { return leaving_[static_cast<std::size_t>(primitive)]; }

  /// The prediction of a field at one point: log N(v; flow, variance) = log_scale - half_precision |v - flow|², up to
  /// a constant.
  struct CellSummary {
    Vector2 flow = Vector2::Zero();
    double half_precision = 0.0, log_scale = 0.0;
  };

 private:
  struct Bucket {
    std::vector<int> transitions;  ///< whose fields may cover it
    /// One for each transition if there are more than `max_shortlisted`, else none.
    std::vector<CellSummary> summaries;
  };

  using Buckets = std::unordered_map<std::int64_t, Bucket>;

  /// Null if no field predicts there.
  const Bucket* bucket_at(const Vector2& position, std::optional<int> site) const;
  void add_transition(int index, std::span<const std::int64_t> buckets, const std::vector<SiteCount>& sites);
  void add_wide_fields();
  void add_summaries();

  double bucket_size_ = 1.0;  ///< [curb units]
  std::size_t max_shortlisted_ = 0;
  std::vector<Site> sites_;
  bool apart_ = true;
  std::vector<Field> fields_;
  std::vector<std::vector<int>> leaving_;
  /// If sites are apart: one for each; else one for all.
  std::vector<Buckets> buckets_;
};

}  // namespace sila
