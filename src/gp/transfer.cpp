#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "core/concatenate.hpp"
#include "gp/fuse_gps.hpp"
#include "sila/core/errors.hpp"

namespace sila {
namespace detail {
namespace {

/// k_b(Z_a, Z_b), where pseudo-inputs common to both are one variable of `into`, jitter included; and the pseudo-inputs
/// of `from` that `into` lacks. Letters: docs/gp.md, section 7, with a = `from` and b = `into`.
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

/// F with F F' = a for a symmetric positive semi-definite a, by pivoted Cholesky; as many columns as a has rank.
Eigen::MatrixXd semidefinite_factor(const Eigen::MatrixXd& a) {
  const Eigen::LDLT<Eigen::MatrixXd> cholesky(a);
  const Eigen::VectorXd pivots = cholesky.vectorD();
  // The pivots fall; those under the rounding of the first are noise of either sign.
  Eigen::Index rank = 0;
  while (rank < pivots.size() && pivots(rank) > 1e-14 * pivots(0)) ++rank;
  Eigen::MatrixXd lower = cholesky.matrixL();
  const Eigen::VectorXd roots = pivots.head(rank).cwiseSqrt();
  const Eigen::MatrixXd scaled = lower.leftCols(rank) * roots.asDiagonal();
  return cholesky.transpositionsP().transpose() * scaled;
}

/// F with E = F F', the covariance of v_a that v_b leaves unexplained. `into` explains common pseudo-inputs completely,
/// so the rank of E is at most the number of the others. Shapes: explained M_a x M_b = k(Z_a, Z_b) L_b^-T.
Eigen::MatrixXd hidden_factor(const SparseGp& from, const SparseGp& into, const std::vector<Eigen::Index>& dropped,
                              const Eigen::MatrixXd& explained, const Eigen::MatrixXd& own_lower) {
  if (dropped.empty()) return {from.pseudo_inputs.cols(), 0};
  const Eigen::MatrixXd points = from.pseudo_inputs(Eigen::all, dropped);
  Eigen::MatrixXd residual = covariance(into.kernel, points, points);
  residual.selfadjointView<Eigen::Lower>().rankUpdate(explained(dropped, Eigen::all), -1.0);
  const Eigen::MatrixXd factor = semidefinite_factor(residual);
  Eigen::MatrixXd hidden = Eigen::MatrixXd::Zero(from.pseudo_inputs.cols(), factor.cols());
  hidden(dropped, Eigen::all) = factor;
  own_lower.triangularView<Eigen::Lower>().solveInPlace(hidden);
  return hidden;
}

/// chol(I + A). With very many points rounding makes it indefinite; then the diagonal is increased until there
/// is a factor, and the transferred information is slightly too small.
Eigen::MatrixXd damping_factor(const Eigen::MatrixXd& a) {
  for (double more = 1.0; std::isfinite(more); more *= 10.0) {
    Eigen::MatrixXd damping = a;
    damping.diagonal().array() += more;
    if (cholesky_in_place(damping)) return damping;
  }
  throw NumericalError("transfer: what is left unexplained is not finite");
}

}  // namespace

bool same_basis(const SparseGp& a, const SparseGp& b) {
  return a.kernel == b.kernel && a.jitter == b.jitter && a.pseudo_inputs.cols() == b.pseudo_inputs.cols() &&
         a.pseudo_inputs == b.pseudo_inputs;
}

Statistics project(const SparseGp& from, const SparseGp& into, const Eigen::MatrixXd& lower) {
  const Statistics stored = about_mean(from, into.mean);
  if (same_basis(from, into)) return stored;
  const Eigen::MatrixXd own_lower = lower_factor(from, "transfer");
  const CrossCovariance cross = cross_covariance(from, into);
  Eigen::MatrixXd explained = whitened(lower, cross.values);
  const Eigen::MatrixXd f = hidden_factor(from, into, cross.dropped, explained, own_lower);
  own_lower.triangularView<Eigen::Lower>().solveInPlace(explained);
  const Eigen::MatrixXd u = explained.transpose();       // L_b^-1 k(Z_b, Z_a) L_a^-T, M_b x M_a
  const Eigen::MatrixXd known = u * stored.information;  // U G
  Eigen::MatrixXd information(u.rows(), u.rows());       // U G U'; only the lower triangle, until it is mirrored
  information.triangularView<Eigen::Lower>() = known * u.transpose();
  Statistics result{{}, u * stored.response, u * stored.mean_response};
  if (f.cols() > 0) {
    const Eigen::MatrixXd damping = damping_factor(f.transpose() * (stored.information * f));  // A = F' G F
    const auto damping_lower = damping.triangularView<Eigen::Lower>();
    const Eigen::MatrixXd lost = whitened(damping, known * f);  // U G F, whitened
    result.response -= lost * damping_lower.solve(f.transpose() * stored.response);
    result.mean_response -= lost * damping_lower.solve(f.transpose() * stored.mean_response);
    information.selfadjointView<Eigen::Lower>().rankUpdate(lost, -1.0);
  }
  result.information = information.selfadjointView<Eigen::Lower>();
  return result;
}

}  // namespace detail

SparseGp transfer(const SparseGp& from, const SparseGp& into) {
  validate(from);
  validate(into);
  if (from.pseudo_inputs.rows() != into.pseudo_inputs.rows() || from.mean.size() != into.mean.size())
    throw invalid_argument("transfer: from has ", from.pseudo_inputs.rows(), " inputs and ", from.mean.size(),
                           " outputs, must be those of into, ", into.pseudo_inputs.rows(), " and ", into.mean.size());
  SparseGp updated = into;
  detail::add(updated, detail::project(from, into, detail::lower_factor(into, "transfer")), from.points);
  return updated;
}

}  // namespace sila
