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
  ResidualIndex(const Model& model, const RefineConfig& config, const Model* earlier = nullptr,
                const ResidualIndex* of_earlier = nullptr);

  const std::optional<Expert>& expert(int transition) const { return experts_[static_cast<std::size_t>(transition)]; }
  /// The global residual GP of a site; at an untrained site, or without its own, that of all sites.
  const std::optional<Posterior>& global(std::optional<int> site) const {
    const bool own = site && global_[static_cast<std::size_t>(*site)];
    return own ? global_[static_cast<std::size_t>(*site)] : untrained_;
  }
  int knots() const { return knots_; }
  double horizon_s() const { return horizon_s_; }

 private:
  int knots_ = 0;
  double horizon_s_ = 0.0;
  std::vector<std::optional<Expert>> experts_;
  std::vector<std::optional<Posterior>> global_;  ///< of each site
  std::optional<Posterior> untrained_;
};

}  // namespace sila
