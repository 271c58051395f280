#include "sila/gp/flow_posterior.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

namespace sila {
namespace {

/// A GP of one component of the velocity as one of both, the other of which is zero: the means of two such add up.
SparseGp beside_zero(SparseGp gp, Eigen::Index component) {
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(2);
  Eigen::MatrixXd response = Eigen::MatrixXd::Zero(gp.response.rows(), 2);
  mean(component) = gp.mean(0), response.col(component) = gp.response.col(0);
  gp.mean = std::move(mean), gp.response = std::move(response);
  return gp;
}

void require_outputs(const SparseGp& gp, Eigen::Index outputs) {
  if (gp.mean.size() == outputs && gp.response.cols() == outputs) return;
  throw std::invalid_argument("flow posterior: a GP has " + std::to_string(gp.mean.size()) + " outputs, must have " +
                              std::to_string(outputs));
}

const SparseGp& checked(const SparseGp& gp, bool alone) {
  require_outputs(gp, alone ? 2 : 1);
  return gp;
}

}  // namespace

FlowPosterior::FlowPosterior(const SparseGp& gp, const SparseGp* gp_y)
    : first_(gp_y ? beside_zero(checked(gp, false), 0) : checked(gp, true)),
      signal_variance_(gp.kernel.signal_variance, (gp_y ? *gp_y : gp).kernel.signal_variance),
      noise_variance_(gp.noise_variance, (gp_y ? *gp_y : gp).noise_variance) {
  if (gp_y) second_.emplace(beside_zero(checked(*gp_y, false), 1));
}

FieldPrediction FlowPosterior::beside(const FlowPrediction& first, const Eigen::Vector2d& x) const {
  const FlowPrediction second = second_->predict_flow(x);
  return {first.mean + second.mean, {first.variance, second.variance}};
}

FieldLinearisation FlowPosterior::linearise(const Eigen::Vector2d& x) const {
  const FlowLinearisation first = first_.linearise_flow(x);
  if (!second_) return {{first.flow.mean, Eigen::Vector2d::Constant(first.flow.variance)}, first.jacobian};
  const FlowLinearisation second = second_->linearise_flow(x);
  return {{first.flow.mean + second.flow.mean, {first.flow.variance, second.flow.variance}},
          first.jacobian + second.jacobian};
}

void FlowPosterior::score(std::span<const double> xs, std::span<const double> ys, std::span<const RasterPlace> places,
                          std::span<FlowPrediction> summaries) const {
  first_.score_flow(xs, ys, places, summaries);
  if (!second_) return;
  std::vector<FlowPrediction> along_y(summaries.size());
  second_->score_flow(xs, ys, places, along_y);
  for (std::size_t i = 0; i < summaries.size(); ++i) {
    summaries[i].mean += along_y[i].mean;
    summaries[i].variance = std::max(summaries[i].variance, along_y[i].variance);
  }
}

}  // namespace sila
