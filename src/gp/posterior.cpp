#include "sila/gp/posterior.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "posterior_simd.hpp"
#include "statistics.hpp"

namespace sila {
namespace {

/// What is hardly below a bound may be above it but for rounding.
constexpr double kRoundingMargin = 1.0 - 1e-9;

std::size_t padded(Eigen::Index size, std::size_t multiple) {
  return (static_cast<std::size_t>(size) + multiple - 1) / multiple * multiple;
}

/// The matrix column by column in an array of `rows` rows and `columns` columns, zeros beyond it.
std::vector<double> padded(const Eigen::MatrixXd& matrix, std::size_t rows, std::size_t columns) {
  std::vector<double> numbers(rows * columns, 0.0);
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    for (Eigen::Index i = 0; i < matrix.rows(); ++i)
      numbers[static_cast<std::size_t>(j) * rows + static_cast<std::size_t>(i)] = matrix(i, j);
  }
  return numbers;
}

/// k(Z, x), on the stack unless there are very many pseudo-inputs.
class Similarities {
 public:
  Similarities(const detail::PosteriorView& view, const double* x) {
    if (view.columns > stack_.size()) heap_.resize(view.columns);
    detail::similarities(view, x, data());
  }
  double* data() { return heap_.empty() ? stack_.data() : heap_.data(); }

 private:
  std::array<double, Posterior::max_stack_pseudo_inputs> stack_;
  std::vector<double> heap_;
};

/// The mean of a flow.
Eigen::Vector2d flow_at(const detail::PosteriorView& view, const double* k, const std::vector<double>& mean) {
  Eigen::Vector2d sums;
  detail::weighted_sums(view, k, sums.data());
  return sums + Eigen::Vector2d(mean[0], mean[1]);
}

Eigen::Matrix2d jacobian_at(const detail::PosteriorView& view, const Eigen::Vector2d& x, const double* k) {
  Eigen::Matrix<double, 2, 2, Eigen::RowMajor> jacobian;
  detail::slopes(view, x.data(), k, jacobian.data());
  return jacobian;
}

double variance_left(const detail::PosteriorView& view, const double* k) {
  return std::max(0.0, view.signal_variance - detail::explained_variance(view, k));
}

}  // namespace

Posterior::Posterior(const SparseGp& gp)
    : signal_variance_(gp.kernel.signal_variance),
      noise_variance_(gp.noise_variance),
      mean_(gp.mean.data(), gp.mean.data() + gp.mean.size()) {
  validate(gp);
  const Eigen::Index size = gp.pseudo_inputs.cols();
  const Eigen::MatrixXd lower = detail::lower_factor(gp, "posterior");
  const auto lower_view = lower.triangularView<Eigen::Lower>();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(size, size);

  const Eigen::LLT<Eigen::MatrixXd> seen(identity + gp.information);  // B
  const Eigen::MatrixXd weights = lower_view.transpose().solve(seen.solve(gp.response));

  // I - B^-1 = F (I + F'F)^-1 F' with G = F F': no difference of large inverses, and the variance cannot exceed the
  // prior.
  const Eigen::MatrixXd factor = detail::semidefinite_factor(gp.information);
  const Eigen::LLT<Eigen::MatrixXd> inner(Eigen::MatrixXd::Identity(factor.cols(), factor.cols()) +
                                          factor.transpose() * factor);
  Eigen::MatrixXd reduction = inner.matrixL().solve(factor.transpose());
  // Of a prior nothing is known; Eigen must not be asked to solve for no rows.
  if (reduction.rows() > 0) lower_view.solveInPlace<Eigen::OnTheRight>(reduction);

  const Eigen::VectorXd inverse = gp.kernel.length_scales.cwiseInverse();
  inverse_length_scales_.assign(inverse.data(), inverse.data() + inverse.size());
  columns_ = padded(size, detail::kColumnPadding), rows_ = padded(reduction.rows(), detail::kRowPadding);
  pseudo_inputs_ = padded(gp.pseudo_inputs.transpose(), columns_, inputs());
  weights_ = padded(weights, columns_, outputs());
  reduction_ = padded(reduction, rows_, columns_);
  reduction_norms_ = padded(reduction.colwise().norm(), 1, columns_);
}

detail::PosteriorView Posterior::view() const {
  return {{inputs(), columns_, pseudo_inputs_.data(), inverse_length_scales_.data(), signal_variance_},
          outputs(),
          rows_,
          weights_.data(),
          reduction_.data()};
}

void Posterior::require_input(std::span<const double> x) const {
  if (x.size() == inputs() && std::all_of(x.begin(), x.end(), [](double value) { return std::isfinite(value); }))
    return;
  throw std::invalid_argument("posterior: x has " + std::to_string(x.size()) + " entries, must have " +
                              std::to_string(inputs()) + " finite ones");
}

void Posterior::require_output(std::span<double> mean) const {
  if (mean.size() == outputs()) return;
  throw std::invalid_argument("posterior: mean has room for " + std::to_string(mean.size()) + " outputs, must be " +
                              std::to_string(outputs()));
}

double Posterior::finish(const detail::PosteriorView& view, const double* k, std::span<double> mean) const {
  detail::weighted_sums(view, k, mean.data());
  for (std::size_t output = 0; output < mean.size(); ++output) mean[output] += mean_[output];
  return variance_left(view, k);
}

double Posterior::predict(std::span<const double> x, std::span<double> mean) const {
  require_input(x), require_output(mean);
  const detail::PosteriorView tables = view();
  Similarities k(tables, x.data());
  return finish(tables, k.data(), mean);
}

double Posterior::most_explained(const detail::PosteriorView& view, const double* k) const {
  detail::PosteriorView norms = view;
  norms.outputs = 1, norms.weights = reduction_norms_.data();
  double most = 0.0;
  detail::weighted_sums(norms, k, &most);
  return most * most / signal_variance_;
}

double Posterior::most_explained(std::span<const double> x) const {
  require_input(x);
  const detail::PosteriorView tables = view();
  Similarities k(tables, x.data());
  return most_explained(tables, k.data());
}

std::optional<double> Posterior::predict_where_known(std::span<const double> x, std::span<double> mean,
                                                     double share) const {
  require_input(x), require_output(mean);
  const detail::PosteriorView tables = view();
  Similarities k(tables, x.data());
  if (most_explained(tables, k.data()) < kRoundingMargin * share) return std::nullopt;
  return finish(tables, k.data(), mean);
}

GpPrediction Posterior::predict(const Eigen::VectorXd& x) const {
  GpPrediction prediction{Eigen::VectorXd(static_cast<Eigen::Index>(outputs())), 0.0};
  prediction.variance =
      predict(std::span(x.data(), static_cast<std::size_t>(x.size())), std::span(prediction.mean.data(), outputs()));
  return prediction;
}

void Posterior::require_flow(const Eigen::Vector2d& x) const {
  if (inputs() == 2 && outputs() == 2 && x.allFinite()) return;
  throw std::invalid_argument("posterior: x = (" + std::to_string(x.x()) + ", " + std::to_string(x.y()) +
                              "), must be finite, and the GP must have 2 inputs and 2 outputs, not " +
                              std::to_string(inputs()) + " and " + std::to_string(outputs()));
}

FlowPrediction Posterior::predict_flow(const Eigen::Vector2d& x) const {
  require_flow(x);
  FlowPrediction flow;
  flow.variance = predict(std::span(x.data(), 2), std::span(flow.mean.data(), 2));
  return flow;
}

FlowPrediction Posterior::glance_at_flow(const Eigen::Vector2d& x) const {
  require_flow(x);
  const detail::PosteriorView tables = view();
  Similarities k(tables, x.data());
  const double least_variance = signal_variance_ * std::max(0.0, 1.0 - most_explained(tables, k.data()));
  return {flow_at(tables, k.data(), mean_), least_variance};
}

Eigen::Vector2d Posterior::flow_mean(const Eigen::Vector2d& x) const {
  require_flow(x);
  const detail::PosteriorView tables = view();
  Similarities k(tables, x.data());
  return flow_at(tables, k.data(), mean_);
}

Eigen::Matrix2d Posterior::mean_jacobian(const Eigen::Vector2d& x) const {
  require_flow(x);
  const detail::PosteriorView tables = view();
  Similarities k(tables, x.data());
  return jacobian_at(tables, x, k.data());
}

FlowLinearisation Posterior::linearise_flow(const Eigen::Vector2d& x) const {
  require_flow(x);
  const detail::PosteriorView tables = view();
  Similarities k(tables, x.data());
  return {{flow_at(tables, k.data(), mean_), variance_left(tables, k.data())}, jacobian_at(tables, x, k.data())};
}

}  // namespace sila
