#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "sila/gp/posterior.hpp"
#include "sila/model/model.hpp"
#include "sila/model/outlook.hpp"

namespace sila {

/// What predictions need of a model, made once: factorised fields, a spatial index over them, and the graph of
/// primitives.
class FieldMap {
 public:
  explicit FieldMap(const Model& model);

  struct Field {
    int from = 0, to = 0;
    double count = 0.0;
    double probability = 0.0;      ///< P(to | from)
    double signal_variance = 1.0;  ///< [widths²/s²]
    double noise_variance = 1.0;
    Posterior posterior;
    std::optional<Posterior> outlook;
    Eigen::AlignedBox<double, kOutlookInputs> outlook_reach;  ///< beyond it the outlook knows nothing
  };

  const Field& field(int transition) const { return fields_[static_cast<std::size_t>(transition)]; }
  /// Transitions whose field may know the place.
  std::span<const int> near(const Vector2& position) const;
  int outlook_knots() const { return outlook_knots_; }
  double outlook_horizon_s() const { return outlook_horizon_s_; }
  const std::optional<Posterior>& gait() const { return gait_; }
  bool knows(const CurbFrame& place) const { return is_known(places_, place); }
  /// Transitions that leave a primitive, in order.
  std::span<const int> leaving(int primitive) const { return leaving_[static_cast<std::size_t>(primitive)]; }

 private:
  double bucket_size_ = 1.0;
  int outlook_knots_ = 0;
  double outlook_horizon_s_ = 0.0;
  std::optional<Posterior> gait_;
  std::vector<CurbFrame> places_;
  std::vector<Field> fields_;
  std::vector<std::vector<int>> leaving_;
  std::unordered_map<std::int64_t, std::vector<int>> buckets_;
};

}  // namespace sila
