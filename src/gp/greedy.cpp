#include "sila/gp/greedy.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "statistics.hpp"

namespace sila {
namespace detail {
namespace {

constexpr double tie = 1e-9;         // relative to the signal variance: rounding must not decide
constexpr double exhausted = 1e-11;  // likewise: what is left is a copy of a chosen point

Eigen::Index first_largest(const Eigen::ArrayXd& variances, double signal_variance) {
  const double bar = variances.maxCoeff() - tie * signal_variance;
  Eigen::Index first = 0;
  while (variances(first) < bar) ++first;
  return first;
}

}  // namespace

Selection select_greedily(const Kernel& kernel, const Eigen::MatrixXd& candidates, Eigen::Index max_count,
                          double stop_fraction, Eigen::Index given) {
  const Eigen::Index count = candidates.cols();
  const Eigen::Index limit = std::min(count, std::max(max_count, given));
  const double signal = kernel.signal_variance;
  Eigen::ArrayXd variances = Eigen::ArrayXd::Constant(count, signal);
  Eigen::MatrixXd factor(count, limit);  // rows of the partial Cholesky factor
  Selection selection;
  selection.cross.resize(count, limit);
  Eigen::Index m = 0;
  for (; m < limit; ++m) {
    const Eigen::Index pivot = m < given ? m : first_largest(variances, signal);
    const double variance = variances(pivot);
    if (m >= given && variance < std::max(stop_fraction, exhausted) * signal) break;
    selection.chosen.push_back(pivot);
    selection.cross.col(m) = covariance(kernel, candidates, candidates.col(pivot));
    factor.col(m) = selection.cross.col(m);
    factor.col(m).noalias() -= factor.leftCols(m) * factor.row(pivot).head(m).transpose();
    factor.col(m) /= std::sqrt(std::max(variance, exhausted * signal));
    variances = (variances - factor.col(m).array().square()).max(0.0);
    variances(pivot) = 0.0;
  }
  selection.cross.conservativeResize(count, m);
  selection.remaining_variance = count > 0 ? variances.maxCoeff() : 0.0;
  return selection;
}

Eigen::MatrixXd thinned(const Eigen::MatrixXd& points, Eigen::Index max_count) {
  const Eigen::Index step = std::max<Eigen::Index>(1, (points.cols() + max_count - 1) / max_count);
  if (step == 1) return points;
  return points(Eigen::all, Eigen::seq(0, points.cols() - 1, step));
}

}  // namespace detail

Eigen::MatrixXd select_pseudo_inputs(const Kernel& kernel, const Eigen::MatrixXd& candidates, int max_count,
                                     double stop_fraction) {
  validate(kernel);
  validate("select_pseudo_inputs", {candidates, Eigen::MatrixXd::Zero(candidates.cols(), 0)},
           kernel.length_scales.size(), 0);
  if (max_count < 0) {
    throw std::invalid_argument("select_pseudo_inputs: max_count = " + std::to_string(max_count) +
                                ", must not be negative");
  }
  if (!(stop_fraction >= 0.0 && stop_fraction <= 1.0)) {
    throw std::invalid_argument("select_pseudo_inputs: stop_fraction = " + std::to_string(stop_fraction) +
                                " is outside [0, 1]");
  }
  return candidates(Eigen::all, detail::select_greedily(kernel, candidates, max_count, stop_fraction).chosen);
}

}  // namespace sila
