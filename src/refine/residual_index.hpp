#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "gp/posterior.hpp"
#include "sila/model/increment.hpp"
#include "sila/model/model.hpp"
#include "sila/refine/config.hpp"

namespace sila {

/// The residual GPs of a model, prepared once for many predictions.
class ResidualIndex {
 public:
  /// The residual GP of a transition.
  struct Expert {
    Posterior posterior;
    Eigen::AlignedBox<double, kResidualInputs> reach;  ///< beyond it the GP is its prior
  };

  /// Posteriors of GPs that are equal in an earlier model are taken from its index.
  ResidualIndex(const Model& model, const Model* earlier = nullptr, const ResidualIndex* of_earlier = nullptr);

  const std::optional<Expert>& expert(int transition) const { return experts_[static_cast<std::size_t>(transition)]; }
  int knots() const { return knots_; }
  double horizon_s() const { return horizon_s_; }

 private:
  int knots_ = 0;
  double horizon_s_ = 0.0;
  std::vector<std::optional<Expert>> experts_;
};

}  // namespace sila
