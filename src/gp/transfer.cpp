#include "transfer.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "linalg/blas.hpp"
#include "sila/core/errors.hpp"

namespace sila {
namespace detail {
namespace {

/// k_b(Z_a, Z_b), where pseudo-inputs that stand in both are one variable of into, jitter included; and which of those
/// of `from` do not.
struct CrossCovariance {
  Eigen::MatrixXd values;  // M_a x M_b
  std::vector<Eigen::Index> dropped;
};

CrossCovariance cross_covariance(const SparseGp& from, const SparseGp& into) {
  CrossCovariance cross{covariance(into.kernel, from.pseudo_inputs, into.pseudo_inputs), {}};
  for (Eigen::Index i = 0; i < cross.values.rows(); ++i) {
    Eigen::Index j = 0;
    while (j < cross.values.cols() && from.pseudo_inputs.col(i) != into.pseudo_inputs.col(j)) ++j;
    if (j < cross.values.cols())
      cross.values(i, j) += into.jitter * into.kernel.signal_variance;
    else
      cross.dropped.push_back(i);
  }
  return cross;
}

/// h_a and e_a about the mean of into.
Statistics about_mean(const SparseGp& from, const Eigen::VectorXd& mean) {
  Statistics shifted{from.information, from.response, from.mean_response};
  if (from.mean != mean) shifted.response += from.mean_response * (from.mean - mean).transpose();
  return shifted;
}

/// How the pseudo-inputs of two GPs hang together, whitened.
struct Link {
  PaddedMatrix basis;   ///< U = L_b^-1 k(Z_b, Z_a) L_a^-T, M_b x M_a
  PaddedMatrix hidden;  ///< G with E = G G', what `into` leaves unexplained of those of `from`
};

/// What `into` has of the pseudo-inputs of `from` it explains whole, so that E has the rank of the others at most.
/// Shapes: explained M_a x M_b = k(Z_a, Z_b) L_b^-T.
PaddedMatrix hidden_factor(const SparseGp& from, const SparseGp& into, const std::vector<Eigen::Index>& dropped,
                           const PaddedMatrix& explained, const PaddedMatrix& own_lower) {
  const Eigen::MatrixXd points = from.pseudo_inputs(Eigen::all, dropped);
  const PaddedMatrix rows(explained.matrix()(dropped, Eigen::all));
  PaddedMatrix residual(covariance(into.kernel, points, points));
  gemmt(residual, rows, transposed(rows));
  mirror_lower(residual);
  const Eigen::MatrixXd factor = semidefinite_factor(residual.matrix());
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(from.pseudo_inputs.cols(), factor.cols());
  for (std::size_t i = 0; i < dropped.size(); ++i) spread.row(dropped[i]) = factor.row(static_cast<Eigen::Index>(i));
  PaddedMatrix hidden(spread);
  trsm_left(hidden, own_lower);
  return hidden;
}

Link link_between(const SparseGp& from, const SparseGp& into, const PaddedMatrix& lower) {
  const PaddedMatrix own_lower = lower_factor(from, "transfer");
  const CrossCovariance cross = cross_covariance(from, into);
  PaddedMatrix explained(cross.values);
  trsm_right_transposed(explained, lower);
  PaddedMatrix hidden = hidden_factor(from, into, cross.dropped, explained, own_lower);
  trsm_left(explained, own_lower);
  return {transposed(explained), std::move(hidden)};
}

/// chol(I + alpha seen). Where very much was seen, rounding makes of it something that is not positive; then so much is
/// added that there is a factor: what is passed on is rather too little.
PaddedMatrix damping_factor(double alpha, PaddedMatrix seen) {
  seen.matrix() *= alpha;
  for (double more = 1.0; std::isfinite(more); more *= 10.0) {
    PaddedMatrix damping = seen;
    damping.matrix().diagonal().array() += more;
    if (potrf(damping)) return damping;
  }
  throw NumericalError("transfer: what is left unexplained is not finite");
}

}  // namespace

bool same_basis(const SparseGp& a, const SparseGp& b) {
  return a.kernel == b.kernel && a.jitter == b.jitter && a.pseudo_inputs.cols() == b.pseudo_inputs.cols() &&
         a.pseudo_inputs == b.pseudo_inputs;
}

Statistics project(const SparseGp& from, const SparseGp& into, const PaddedMatrix& lower, double alpha) {
  const Statistics stored = about_mean(from, into.mean);
  if (same_basis(from, into)) return stored;
  const Link link = link_between(from, into, lower);
  const PaddedMatrix known = gemm(link.basis, PaddedMatrix(stored.information));  // U S
  PaddedMatrix information = gemmt(known, transposed(link.basis));                // U S U'
  const PaddedMatrix::ConstView u = link.basis.matrix(), g = link.hidden.matrix();
  Statistics result{{}, u * stored.response, u * stored.mean_response};
  if (alpha > 0.0 && link.hidden.columns() > 0) {
    const PaddedMatrix damping =
        damping_factor(alpha, gemmt(transposed(link.hidden), gemm(PaddedMatrix(stored.information), link.hidden)));
    PaddedMatrix lost = gemm(known, link.hidden);  // U S G
    trsm_right_transposed(lost, damping);
    PaddedMatrix response_part(g.transpose() * stored.response), mean_part(g.transpose() * stored.mean_response);
    trsm_left(response_part, damping);
    trsm_left(mean_part, damping);
    result.response -= alpha * lost.matrix() * response_part.matrix();
    result.mean_response -= alpha * lost.matrix() * mean_part.matrix();
    lost.matrix() *= std::sqrt(alpha);
    gemmt(information, lost, transposed(lost));
  }
  mirror_lower(information);
  result.information = information.matrix();
  return result;
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
  detail::add(updated, detail::project(from, into, detail::lower_factor(into, "transfer"), alpha), from.points);
  return updated;
}

}  // namespace sila
