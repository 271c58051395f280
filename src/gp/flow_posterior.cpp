#include "gp/flow_posterior.hpp"

#include "core/concatenate.hpp"

namespace sila {
namespace {

/// A GP of one component of the velocity as a GP of both, the other component zero: the means of two such GPs add up.
SparseGp with_zero_output(SparseGp gp, Eigen::Index component) {
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(2);
  Eigen::MatrixXd response = Eigen::MatrixXd::Zero(gp.response.rows(), 2);
  mean(component) = gp.mean(0);
  response.col(component) = gp.response.col(0);
  gp.mean = std::move(mean);
  gp.response = std::move(response);
  return gp;
}

const SparseGp& checked(const SparseGp& gp, Eigen::Index outputs) {
  if (gp.mean.size() == outputs && gp.response.cols() == outputs) return gp;
  throw invalid_argument("flow posterior: a GP has ", gp.mean.size(), " outputs, must have ", outputs);
}

}  // namespace

FlowPosterior::FlowPosterior(const SparseGp& gp, const SparseGp* gp_y)
    : first_(gp_y ? with_zero_output(checked(gp, 1), 0) : checked(gp, 2)),
      signal_variance_(gp.kernel.signal_variance, (gp_y ? *gp_y : gp).kernel.signal_variance),
      noise_variance_(gp.noise_variance, (gp_y ? *gp_y : gp).noise_variance) {
  if (gp_y) second_.emplace(with_zero_output(checked(*gp_y, 1), 1));
}

FieldLinearisation FlowPosterior::linearise(const Eigen::Vector2d& x) const {
  const FieldLinearisation first = first_.linearise_flow(x);
  if (!second_) return first;
  const FieldLinearisation second = second_->linearise_flow(x);
  return {sum(first.flow, second.flow), first.jacobian + second.jacobian};
}

std::vector<FieldPrediction> FlowPosterior::bounds(std::span<const double> xs, std::span<const double> ys,
                                                   std::span<const RasterIndex> points) const {
  std::vector<FieldPrediction> flows = first_.bound_flows(xs, ys, points);
  if (!second_) return flows;
  std::ranges::transform(flows, second_->bound_flows(xs, ys, points), flows.begin(), &FlowPosterior::sum);
  return flows;
}

}  // namespace sila
