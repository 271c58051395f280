#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "sila/core/trajectory.hpp"
#include "sila/gp/posterior.hpp"
#include "sila/model/model.hpp"
#include "sila/model/outlook.hpp"
#include "sila/predict/config.hpp"
#include "sila/predict/scratch.hpp"

namespace sila {

/// What predictions need of a model, made once: factorised fields, a spatial index over them, and the graph of
/// primitives.
class FieldMap {
 public:
  /// A model and its map, or neither.
  struct Made {
    const Model* model = nullptr;
    const FieldMap* map = nullptr;
  };

  FieldMap(const Model& model, const PredictConfig& config) : FieldMap(model, config, Made{}) {}
  /// What the model has of an earlier one is not factorised again.
  FieldMap(const Model& model, const PredictConfig& config, const Made& earlier);

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
  /// Transitions whose field may know where the person is now, in order. Where more than `max_asked` overlap, those
  /// whose flow in the middle of the bucket is likeliest to move somebody so.
  std::span<const int> near(const CurbTrajectory& observed, Scratch& scratch) const;
  int outlook_knots() const { return outlook_knots_; }
  double outlook_horizon_s() const { return outlook_horizon_s_; }
  /// How walking goes on, whatever the place; what counts of it where nothing was learnt.
  const std::optional<Posterior>& gait(bool known_place) const { return known_place ? gait_ : gait_elsewhere_; }
  bool knows(const CurbFrame& place) const { return is_known(places_, place); }
  /// Transitions that leave a primitive, in order.
  std::span<const int> leaving(int primitive) const { return leaving_[static_cast<std::size_t>(primitive)]; }

  /// What a field says of one point: log N(v; flow, variance) = log_scale - half_precision |v - flow|², up to a
  /// constant.
  struct Glimpse {
    Vector2 flow = Vector2::Zero();
    double half_precision = 0.0, log_scale = 0.0;
  };

 private:
  /// Where a person may be.
  struct Bucket {
    std::vector<int> transitions;
    std::vector<Glimpse> glimpses;  ///< one for each transition where there are more than `max_asked`, else none
  };

  const Bucket* bucket_at(const Vector2& position) const;
  void add_wide_fields();
  void add_glimpses();

  double bucket_size_ = 1.0;
  std::size_t max_asked_ = 0;
  int outlook_knots_ = 0;
  double outlook_horizon_s_ = 0.0;
  std::optional<Posterior> gait_, gait_elsewhere_;
  std::vector<CurbFrame> places_;
  std::vector<Field> fields_;
  std::vector<std::vector<int>> leaving_;
  std::unordered_map<std::int64_t, Bucket> buckets_;
};

}  // namespace sila
