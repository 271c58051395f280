#include "refine/residual_index.hpp"

#include <tbb/parallel_for.h>

#include "gp/earlier_gps.hpp"

namespace sila {
namespace {

/// This many length scales from a pseudo-input it explains 1e-4 of what it explains at its own position, or less.
constexpr double kReach = 3.1;

Eigen::AlignedBox<double, kResidualInputs> reach_of(const SparseGp& gp) {
  const Eigen::VectorXd reach = kReach * gp.kernel.length_scales;
  return {gp.pseudo_inputs.rowwise().minCoeff() - reach, gp.pseudo_inputs.rowwise().maxCoeff() + reach};
}

}  // namespace

ResidualIndex::ResidualIndex(const Model& model, const Model* earlier, const ResidualIndex* of_earlier)
    : knots_(model.settings.residual_knots),
      horizon_s_(model.settings.residual_horizon_s),
      experts_(model.transitions.size()) {
  EarlierGps known;
  for (std::size_t i = 0; earlier && i < earlier->transitions.size(); ++i) {
    const SparseGp& gp = earlier->transitions[i].residual;
    if (gp.points > 0.0) known.add(gp, static_cast<int>(i));
  }
  tbb::parallel_for(std::size_t{0}, experts_.size(), [&](std::size_t i) {
    const SparseGp& gp = model.transitions[i].residual;
    if (!(gp.points > 0.0)) return;
    const std::optional<int> same = known.find(gp);
    experts_[i] = same ? of_earlier->expert(*same) : Expert{Posterior(gp), reach_of(gp)};
  });
}

}  // namespace sila
