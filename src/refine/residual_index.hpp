#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "gp/posterior.hpp"
#include "sila/model/increment.hpp"
#include "sila/model/model.hpp"
#include "sila/refine/config.hpp"

namespace sila {

/// What predictions need of the residual GPs of a model, made once.
class ResidualIndex {
 public:
  /// The residual GP of a transition.
  struct Expert {
    Posterior posterior;
    Eigen::AlignedBox<double, kResidualInputs> reach;  ///< beyond it the GP is its prior
  };

  ResidualIndex(const Model& model, const RefineConfig& config) : ResidualIndex(model, config, nullptr, nullptr) {}

  const std::optional<Expert>& expert(int transition) const { return experts_[static_cast<std::size_t>(transition)]; }
  /// The global residual GP of a site, or else what counts of all others.
  const std::optional<Posterior>& global(std::optional<int> site) const {
    const bool own = site && global_[static_cast<std::size_t>(*site)];
    return own ? global_[static_cast<std::size_t>(*site)] : untrained_;
  }
  int knots() const { return knots_; }
  double horizon_s() const { return horizon_s_; }

 private:
  friend class PreparedModel;
  /// Posteriors of GPs that are equal in an earlier model are taken from its index.
  ResidualIndex(const Model& model, const RefineConfig& config, const Model* earlier, const ResidualIndex* of_earlier);

  int knots_ = 0;
  double horizon_s_ = 0.0;
  std::vector<std::optional<Expert>> experts_;
  std::vector<std::optional<Posterior>> global_;  ///< of each site
  std::optional<Posterior> untrained_;
};

}  // namespace sila
