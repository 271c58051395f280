#include "sila/gp/transfer.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "projection.hpp"
#include "sila/core/errors.hpp"
#include "triangles.hpp"

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

/// How the pseudo-inputs of two GPs hang together, whitened.
struct Link {
  PaddedMatrix basis;     ///< U = L_b^-1 k(Z_b, Z_a) L_a^-T, M_b x M_a
  PaddedMatrix residual;  ///< E, what `into` leaves unexplained of those of `from`, M_a x M_a
};

Link link_between(const SparseGp& from, const SparseGp& into, const PaddedMatrix& lower) {
  const PaddedMatrix own_lower = lower_factor(from, "transfer");
  const JointCovariance joint = joint_covariance(from, into);
  PaddedMatrix basis(joint.cross);
  divide_by_transposed(basis, lower);
  PaddedMatrix residual(joint.own);
  take_product(residual, basis, transposed(basis), Part::lower);
  mirror_lower(residual);
  divide_from_left(residual, own_lower), divide_by_transposed(residual, own_lower);
  divide_from_left(basis, own_lower);
  return {transposed(basis), std::move(residual)};
}

/// chol(I + alpha unexplained). Where very much was seen, rounding makes of what is explained whole something that is
/// not positive; then so much is added that there is a factor: what is passed on is rather too little.
PaddedMatrix damping_factor(double alpha, PaddedMatrix unexplained) {
  unexplained.matrix() *= alpha;
  for (double more = 1.0; std::isfinite(more); more *= 10.0) {
    PaddedMatrix damping = unexplained;
    damping.matrix().diagonal().array() += more;
    if (to_cholesky_factor(damping)) return damping;
  }
  throw NumericalError("transfer: what is left unexplained is not finite");
}

}  // namespace

bool same_basis(const SparseGp& a, const SparseGp& b) {
  return a.kernel == b.kernel && a.jitter == b.jitter && a.pseudo_inputs.cols() == b.pseudo_inputs.cols() &&
         a.pseudo_inputs == b.pseudo_inputs;
}

Projection project(const SparseGp& from, const SparseGp& into, const PaddedMatrix& lower, double alpha) {
  const Statistics stored = about_mean(from, into.mean);
  if (same_basis(from, into)) return {stored, 0.0};
  const Link link = link_between(from, into, lower);
  const PaddedMatrix factor(semidefinite_factor(stored.information));  // F
  PaddedMatrix projected = product(link.basis, factor);                // U F
  const PaddedMatrix::ConstView u = link.basis.matrix();
  Statistics result{{}, u * stored.response, u * stored.mean_response};
  double log_evidence = 0.0;
  if (alpha > 0.0 && factor.columns() > 0) {
    const PaddedMatrix seen = product(link.residual, factor);                                            // E F
    const PaddedMatrix damping = damping_factor(alpha, product(transposed(factor), seen, Part::lower));  // L_Q
    divide_by_transposed(projected, damping);                                                            // U F L_Q^-T
    PaddedMatrix response_part(seen.matrix().transpose() * stored.response);
    PaddedMatrix mean_part(seen.matrix().transpose() * stored.mean_response);
    divide_vectors(response_part, damping), divide_vectors(mean_part, damping);
    result.response -= alpha * projected.matrix() * response_part.matrix();
    result.mean_response -= alpha * projected.matrix() * mean_part.matrix();
    const double outputs = static_cast<double>(stored.response.cols());
    const double quadratic = (stored.response.transpose() * link.residual.matrix() * stored.response).trace();
    log_evidence = -outputs * damping.matrix().diagonal().array().log().sum() +
                   0.5 * (quadratic - response_part.matrix().squaredNorm());
  }
  PaddedMatrix information = product(projected, transposed(projected), Part::lower);
  mirror_lower(information);
  result.information = information.matrix();
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
