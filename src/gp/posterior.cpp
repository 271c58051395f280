#include "sila/gp/posterior.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "statistics.hpp"

namespace sila {
namespace {

constexpr Eigen::Index padding = 4;

Eigen::Index padded(Eigen::Index size) {
  return (size + padding - 1) / padding * padding;
}

/// |reduction k|^2, column by column so that the inner loop runs over contiguous rows.
template <class Vector>
double explained_variance(const Eigen::MatrixXd& reduction, const Vector& k) {
  Vector reduced = Vector::Zero(reduction.rows());
  const Eigen::Index rows = reduction.rows();
  double* out = reduced.data();
  const double* column = reduction.data();
  for (Eigen::Index j = 0; j < reduction.cols(); ++j, column += rows) {
    const double value = k(j);
    for (Eigen::Index i = 0; i < rows; ++i) out[i] += column[i] * value;
  }
  return reduced.square().sum();
}

/// MaxRows bounds the kernel vector, so that it lives on the stack; Eigen::Dynamic for larger ones.
template <int MaxRows, bool with_variance, bool with_jacobian>
FlowLinearisation evaluate(const detail::FlowTables& flow, const Eigen::Vector2d& x) {
  using Vector = Eigen::Array<double, Eigen::Dynamic, 1, 0, MaxRows, 1>;
  const Vector first = (flow.inputs.col(0) - x.x()) * flow.inverse_length_scales.x();
  const Vector second = (flow.inputs.col(1) - x.y()) * flow.inverse_length_scales.y();
  const Vector k = flow.signal_variance * (-0.5 * (first.square() + second.square())).exp();
  FlowLinearisation result;
  for (Eigen::Index p = 0; p < 2; ++p) {
    const Vector share = flow.weights.col(p) * k;
    result.flow.mean(p) = flow.mean(p) + share.sum();
    if constexpr (with_jacobian) {
      result.jacobian(p, 0) = flow.inverse_length_scales.x() * (share * first).sum();
      result.jacobian(p, 1) = flow.inverse_length_scales.y() * (share * second).sum();
    }
  }
  if constexpr (with_variance) {
    result.flow.variance = std::max(0.0, flow.signal_variance - explained_variance(flow.reduction, k));
  }
  return result;
}

template <bool with_variance, bool with_jacobian>
FlowLinearisation evaluate(const detail::FlowTables& flow, const Eigen::Vector2d& x) {
  constexpr int stack = static_cast<int>(Posterior::max_stack_pseudo_inputs);
  return flow.inputs.rows() <= stack ? evaluate<stack, with_variance, with_jacobian>(flow, x)
                                     : evaluate<Eigen::Dynamic, with_variance, with_jacobian>(flow, x);
}

detail::FlowTables flow_tables(const SparseGp& gp, const Eigen::MatrixXd& weights, const Eigen::MatrixXd& reduction) {
  const Eigen::Index size = gp.pseudo_inputs.cols();
  detail::FlowTables flow{gp.mean,
                          gp.kernel.length_scales.cwiseInverse(),
                          gp.kernel.signal_variance,
                          Eigen::ArrayX2d::Zero(padded(size), 2),
                          Eigen::ArrayX2d::Zero(padded(size), 2),
                          Eigen::MatrixXd::Zero(padded(reduction.rows()), size)};
  flow.inputs.topRows(size) = gp.pseudo_inputs.transpose().array();
  flow.weights.topRows(size) = weights.array();
  flow.reduction.topRows(reduction.rows()) = reduction;
  return flow;
}

}  // namespace

Posterior::Posterior(const SparseGp& gp)
    : kernel_(gp.kernel), noise_variance_(gp.noise_variance), mean_(gp.mean), pseudo_inputs_(gp.pseudo_inputs) {
  validate(gp);
  const Eigen::Index size = gp.pseudo_inputs.cols();
  const Eigen::MatrixXd lower = detail::lower_factor(gp, "posterior");
  const auto lower_view = lower.triangularView<Eigen::Lower>();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(size, size);

  const Eigen::LLT<Eigen::MatrixXd> seen(identity + gp.information);  // B
  weights_ = lower_view.transpose().solve(seen.solve(gp.response));

  // I - B^-1 = F (I + F'F)^-1 F' with G = F F': no difference of large inverses, and the variance cannot exceed the
  // prior.
  const Eigen::MatrixXd factor = detail::semidefinite_factor(gp.information);
  const Eigen::LLT<Eigen::MatrixXd> inner(Eigen::MatrixXd::Identity(factor.cols(), factor.cols()) +
                                          factor.transpose() * factor);
  reduction_ = inner.matrixL().solve(factor.transpose());
  lower_view.solveInPlace<Eigen::OnTheRight>(reduction_);

  is_flow_ = gp.pseudo_inputs.rows() == 2 && gp.mean.size() == 2;
  if (is_flow_) flow_ = flow_tables(gp, weights_, reduction_);
}

GpPrediction Posterior::predict(const Eigen::VectorXd& x) const {
  if (x.size() != pseudo_inputs_.rows() || !x.allFinite()) {
    throw std::invalid_argument("posterior: x has " + std::to_string(x.size()) + " entries, must have " +
                                std::to_string(pseudo_inputs_.rows()) + " finite ones");
  }
  const Eigen::VectorXd k = covariance(kernel_, pseudo_inputs_, x);
  return {mean_ + weights_.transpose() * k, std::max(0.0, kernel_.signal_variance - (reduction_ * k).squaredNorm())};
}

void Posterior::require_flow(const Eigen::Vector2d& x) const {
  if (is_flow_ && x.allFinite()) return;
  throw std::invalid_argument("posterior: x = (" + std::to_string(x.x()) + ", " + std::to_string(x.y()) +
                              "), must be finite, and the GP must have 2 inputs and 2 outputs, not " +
                              std::to_string(pseudo_inputs_.rows()) + " and " + std::to_string(mean_.size()));
}

FlowPrediction Posterior::predict_flow(const Eigen::Vector2d& x) const {
  require_flow(x);
  return evaluate<true, false>(flow_, x).flow;
}

Eigen::Matrix2d Posterior::mean_jacobian(const Eigen::Vector2d& x) const {
  require_flow(x);
  return evaluate<false, true>(flow_, x).jacobian;
}

FlowLinearisation Posterior::linearise_flow(const Eigen::Vector2d& x) const {
  require_flow(x);
  return evaluate<true, true>(flow_, x);
}

}  // namespace sila
