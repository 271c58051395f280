#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "statistics.hpp"

namespace sila::detail {
namespace {

constexpr double tie = 1e-9;         // relative to the signal variance: rounding must not decide
constexpr double exhausted = 1e-11;  // relative to the signal variance: below it only rounding is left

Eigen::Index first_largest(const Eigen::ArrayXd& variances, double signal_variance) {
  const double bar = variances.maxCoeff() - tie * signal_variance;
  Eigen::Index first = 0;
  while (variances(first) < bar) ++first;
  return first;
}

/// Every k-th column, k the smallest that leaves at most `max_count`.
Eigen::MatrixXd subsample(const Eigen::MatrixXd& points, Eigen::Index max_count) {
  const Eigen::Index step = std::max<Eigen::Index>(1, (points.cols() + max_count - 1) / max_count);
  if (step == 1) return points;
  return points(Eigen::all, Eigen::seq(0, points.cols() - 1, step));
}

}  // namespace

Selection select_greedily(const Kernel& kernel, const Eigen::MatrixXd& candidates, Eigen::Index max_count,
                          double stop_fraction, double jitter, Eigen::Index given) {
  const Eigen::Index count = candidates.cols();
  const Eigen::Index limit = std::min(count, std::max(max_count, given));
  const double signal = kernel.signal_variance;
  const double least = std::max(stop_fraction, exhausted + 2.0 * jitter);  // a copy of a chosen point keeps the jitter
  CovarianceColumns columns(kernel, candidates);
  Eigen::ArrayXd variances = Eigen::ArrayXd::Constant(count, signal);
  Selection selection{{}, Eigen::MatrixXd::Zero(limit, limit), 0.0, true};
  Eigen::MatrixXd features(count, limit);
  Eigen::Index m = 0;
  for (; m < limit; ++m) {
    const Eigen::Index pivot = m < given ? m : first_largest(variances, signal);
    const double variance = variances(pivot);
    if (m >= given && variance < least * signal) break;
    selection.chosen.push_back(pivot);
    selection.sound = selection.sound && variance + jitter * signal >= exhausted * signal;
    const double root = std::sqrt(std::max(variance + jitter * signal, exhausted * signal));
    selection.lower.row(m).head(m) = features.row(pivot).head(m);
    selection.lower(m, m) = root;
    auto column = features.col(m);
    column = columns.at(candidates.col(pivot).data()).head(count);
    column.noalias() -= features.leftCols(m) * features.row(pivot).head(m).transpose();
    column /= root;
    variances = (variances - column.array().square()).max(0.0);
    variances(pivot) = 0.0;
  }
  selection.lower.conservativeResize(m, m);
  selection.remaining_variance = count > 0 ? variances.maxCoeff() : 0.0;
  return selection;
}

Eigen::MatrixXd candidates_for(const Kernel& kernel, const Eigen::MatrixXd& points) {
  const Eigen::ArrayXd step = GpConfig::lattice_step * kernel.length_scales.array();
  std::set<std::vector<double>> known;
  std::vector<Eigen::Index> first;
  Eigen::MatrixXd lattice(points.rows(), points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    lattice.col(i) = step * (points.col(i).array() / step).round() + 0.0;  // + 0.0: no -0, which is another point
    if (known.emplace(lattice.col(i).begin(), lattice.col(i).end()).second) first.push_back(i);
  }
  return subsample(lattice(Eigen::all, first), GpConfig::max_candidates);
}

}  // namespace sila::detail
