#include "sila/gp/transfer.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <stdexcept>
#include <string>

#include "projection.hpp"

namespace sila {
namespace detail {
namespace {

/// k_b(Z_a, Z_b) and k_b(Z_a, Z_a), where pseudo-inputs that stand in both are one variable of into, jitter included.
struct JointCovariance {
  Eigen::MatrixXd cross;  // M_a x M_b
  Eigen::MatrixXd own;    // M_a x M_a
};

JointCovariance joint_covariance(const SparseGp& from, const SparseGp& into) {
  JointCovariance joint{covariance(into.kernel, from.pseudo_inputs, into.pseudo_inputs),
                        covariance(into.kernel, from.pseudo_inputs, from.pseudo_inputs)};
  const double nugget = into.jitter * into.kernel.signal_variance;
  for (Eigen::Index i = 0; i < joint.cross.rows(); ++i) {
    for (Eigen::Index j = 0; j < joint.cross.cols(); ++j) {
      if (from.pseudo_inputs.col(i) != into.pseudo_inputs.col(j)) continue;
      joint.cross(i, j) += nugget;
      joint.own(i, i) += nugget;
      break;
    }
  }
  return joint;
}

/// h_a and e_a about the mean of into.
Statistics about_mean(const SparseGp& from, const Eigen::VectorXd& mean) {
  Statistics shifted{from.information, from.response, from.mean_response};
  if (from.mean != mean) shifted.response += from.mean_response * (from.mean - mean).transpose();
  return shifted;
}

}  // namespace

bool same_basis(const SparseGp& a, const SparseGp& b) {
  return a.kernel == b.kernel && a.jitter == b.jitter && a.pseudo_inputs.cols() == b.pseudo_inputs.cols() &&
         a.pseudo_inputs == b.pseudo_inputs;
}

Projection project(const SparseGp& from, const SparseGp& into, const Eigen::MatrixXd& lower, double alpha) {
  const Statistics stored = about_mean(from, into.mean);
  if (same_basis(from, into)) return {stored, 0.0};
  const auto lower_view = lower.triangularView<Eigen::Lower>();
  const Eigen::MatrixXd own_lower = lower_factor(from, "transfer");
  const auto own_view = own_lower.triangularView<Eigen::Lower>();
  const JointCovariance joint = joint_covariance(from, into);

  Eigen::MatrixXd basis = joint.cross;  // U' = L_a^-1 W', M_a x M_b
  lower_view.transpose().solveInPlace<Eigen::OnTheRight>(basis);
  const Eigen::MatrixXd unexplained = joint.own - basis * basis.transpose();
  own_view.solveInPlace(basis);
  const Eigen::MatrixXd half = own_view.solve(unexplained);
  Eigen::MatrixXd residual = own_view.solve(half.transpose());  // E
  residual = (0.5 * (residual + residual.transpose())).eval();

  const Eigen::MatrixXd factor = semidefinite_factor(stored.information);  // F
  Eigen::MatrixXd projected = basis.transpose() * factor;                  // U F
  Statistics result{{}, basis.transpose() * stored.response, basis.transpose() * stored.mean_response};
  double log_evidence = 0.0;
  if (alpha > 0.0 && factor.cols() > 0) {
    const Eigen::MatrixXd seen = residual * factor;  // E F
    Eigen::MatrixXd damping = alpha * factor.transpose() * seen;
    damping.diagonal().array() += 1.0;
    const Eigen::LLT<Eigen::MatrixXd> cholesky(damping);            // of Q
    cholesky.matrixU().solveInPlace<Eigen::OnTheRight>(projected);  // U F L_Q^-T
    const Eigen::MatrixXd response_part = cholesky.matrixL().solve(seen.transpose() * stored.response);
    const Eigen::VectorXd mean_part = cholesky.matrixL().solve(seen.transpose() * stored.mean_response);
    result.response -= alpha * projected * response_part;
    result.mean_response -= alpha * projected * mean_part;
    const double outputs = static_cast<double>(stored.response.cols());
    const double quadratic = (stored.response.transpose() * residual * stored.response).trace();
    log_evidence = -outputs * cholesky.matrixLLT().diagonal().array().log().sum() +
                   0.5 * (quadratic - response_part.squaredNorm());
  }
  result.information = projected * projected.transpose();
  return {std::move(result), log_evidence};
}

}  // namespace detail

SparseGp transfer(const SparseGp& from, const SparseGp& into, double alpha) {
  detail::require_alpha("transfer", alpha);
  validate(from), validate(into);
  if (from.pseudo_inputs.rows() != into.pseudo_inputs.rows() || from.mean.size() != into.mean.size()) {
    throw std::invalid_argument("transfer: from has " + std::to_string(from.pseudo_inputs.rows()) + " inputs and " +
                                std::to_string(from.mean.size()) + " outputs, must be those of into, " +
                                std::to_string(into.pseudo_inputs.rows()) + " and " + std::to_string(into.mean.size()));
  }
  SparseGp updated = into;
  detail::add(updated, detail::project(from, into, detail::lower_factor(into, "transfer"), alpha).statistics,
              from.points);
  return updated;
}

}  // namespace sila
