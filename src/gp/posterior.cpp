#include "gp/posterior.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/concatenate.hpp"
#include "posterior_simd.hpp"
#include "sila/core/errors.hpp"
#include "statistics.hpp"

namespace sila {
namespace {

/// Tolerance of the bound: without it, rounding could reject a sum that reaches the bound exactly.
constexpr double kRoundingMargin = 1.0 - 1e-9;
/// Added to the diagonal of I - B^-1, relative to the signal variance: a variance may be too small by this.
constexpr double least_added = 1e-14, most_added = 1e-3;

/// Copies a matrix, column by column, to columns of `rows` rows; the padding is left unchanged.
void copy_padded(const Eigen::Ref<const Eigen::MatrixXd>& matrix, double* to, std::size_t rows) {
  for (Eigen::Index j = 0; j < matrix.cols(); ++j, to += rows) Eigen::VectorXd::Map(to, matrix.rows()) = matrix.col(j);
}

/// Copies a lower triangle into panels; the padding is left unchanged.
void copy_in_panels(const Eigen::Ref<const Eigen::MatrixXd>& triangle, double* to, std::size_t columns) {
  const Eigen::Index size = triangle.cols(), panel_rows = detail::kPanelRows;
  for (Eigen::Index row = 0; row < size; row += panel_rows) {
    const auto width = static_cast<Eigen::Index>(detail::panel_columns(static_cast<std::size_t>(row), columns));
    const Eigen::Index rows = std::min(panel_rows, size - row), used = std::min(width, size);
    Eigen::MatrixXd::Map(to, panel_rows, width).topLeftCorner(rows, used) = triangle.block(row, 0, rows, used);
    to += width * panel_rows;
  }
}

std::size_t numbers_in_panels(std::size_t columns) {
  std::size_t numbers = 0;
  for (std::size_t row = 0; row < columns; row += detail::kPanelRows)
    numbers += detail::panel_columns(row, columns) * detail::kPanelRows;
  return numbers;
}

/// S, a lower triangle, with S'S = I - B^-1, from the Cholesky factor of the reversed B: S reversed is the transpose of
/// a Cholesky factor. In directions without data the difference is rounding, of either sign; as little as possible is
/// added to the diagonal for a factor to exist.
Eigen::MatrixXd reduction_factor(const Eigen::MatrixXd& b_reversed) {
  const Eigen::Index size = b_reversed.rows();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(size, size);
  const Eigen::MatrixXd inverse = b_reversed.triangularView<Eigen::Lower>().solve(identity);
  Eigen::MatrixXd difference = identity;
  difference.selfadjointView<Eigen::Lower>().rankUpdate(inverse.transpose(), -1.0);
  for (double more = least_added; more <= most_added; more *= 10.0) {
    Eigen::MatrixXd factor = difference;
    factor.diagonal().array() += more;
    if (!detail::cholesky_in_place(factor)) continue;
    Eigen::MatrixXd reduction = Eigen::MatrixXd::Zero(size, size);
    reduction.triangularView<Eigen::Lower>() = factor.reverse().transpose();
    return reduction;
  }
  throw NumericalError(concatenate("posterior: I - B^-1 of ", size, " pseudo-inputs has no Cholesky factor"));
}

/// The Cholesky factor of B = I + information, rows and columns reversed.
Eigen::MatrixXd reversed_factor_of_b(const Eigen::MatrixXd& information) {
  Eigen::MatrixXd b = information.reverse();
  b.diagonal().array() += 1.0;
  if (detail::cholesky_in_place(b)) return b;
  throw NumericalError(
      concatenate("posterior: I + information of ", information.rows(), " pseudo-inputs has no Cholesky factor"));
}

/// L_u^-T B^-1 response.
Eigen::MatrixXd weights_of(const SparseGp& gp, const Eigen::MatrixXd& lower, const Eigen::MatrixXd& b_reversed) {
  const auto b = b_reversed.triangularView<Eigen::Lower>();
  const Eigen::MatrixXd reversed = b.transpose().solve(b.solve(gp.response.colwise().reverse()));
  return lower.triangularView<Eigen::Lower>().transpose().solve(reversed.colwise().reverse());
}

/// k(Z, x), on the stack up to max_stack_pseudo_inputs.
class KernelVector {
 public:
  KernelVector(const detail::PosteriorView& view, const double* x) {
    if (view.columns > stack_.size()) heap_.resize(view.columns);
    detail::kernel_vector(view, x, data());
  }
  double* data() { return heap_.empty() ? stack_.data() : heap_.data(); }

 private:
  alignas(64) std::array<double, Posterior::max_stack_pseudo_inputs> stack_;
  std::vector<double> heap_;
};

/// One input's factor of k(Z, x) for each of its values, one after another; the signal variance is part of it.
class KernelFactors {
 public:
  KernelFactors(const detail::PosteriorView& view, std::size_t input, double signal_variance,
                std::span<const double> values, std::size_t first)
      : first_(first), columns_(view.columns), numbers_(values.size() * view.columns) {
    const detail::KernelView one{1, columns_, view.points + input * columns_, view.inverse_length_scales + input,
                                 signal_variance};
    for (std::size_t i = 0; i < values.size(); ++i) detail::kernel_vector(one, &values[i], &numbers_[i * columns_]);
  }
  const double* at(std::size_t value) const { return numbers_.data() + (value - first_) * columns_; }

 private:
  std::size_t first_, columns_;
  std::vector<double> numbers_;
};

/// The first column (or row) of the points, and the number of columns from it to the last.
template <std::size_t RasterIndex::*Index>
std::pair<std::size_t, std::size_t> used(std::span<const RasterIndex> points) {
  const auto [least, greatest] = std::ranges::minmax(points, {}, Index);
  return {least.*Index, greatest.*Index + 1 - least.*Index};
}

double explained_share_bound(const detail::PosteriorView& view, double sum_of_norms) {
  return sum_of_norms * sum_of_norms / view.signal_variance;
}

double variance_left(const detail::PosteriorView& view, const double* k) {
  return std::max(0.0, view.signal_variance - detail::explained_variance(view, k));
}

FieldPrediction flow_at(const detail::PosteriorView& view, const double* k) {
  FieldPrediction flow;
  detail::means(view, k, flow.mean.data());
  flow.variance.setConstant(variance_left(view, k));
  return flow;
}

void require_input(const Posterior& posterior, std::span<const double> x) {
  if (x.size() == posterior.inputs() && std::all_of(x.begin(), x.end(), [](double v) { return std::isfinite(v); }))
    return;
  throw invalid_argument("posterior: x has ", x.size(), " entries, must have ", posterior.inputs(), " finite ones");
}

void require_flow(const Posterior& posterior, const Eigen::Vector2d& x) {
  if (posterior.inputs() == 2 && posterior.outputs() == 2 && x.allFinite()) return;
  throw invalid_argument("posterior: x = (", x.x(), ", ", x.y(),
                         "), must be finite, and the GP must have 2 inputs and 2 outputs, not ", posterior.inputs(),
                         " and ", posterior.outputs());
}

}  // namespace

namespace detail {

/// The tables of a posterior, one after another as in the view.
struct PosteriorTables {
  /// One vector register holds at most this. Rows of tables begin with a line, so that no register is read from two.
  struct alignas(64) Line {
    double numbers[8];
  };
  static_assert(sizeof(Line) == kColumnPadding * sizeof(double));

  PosteriorTables(const SparseGp& gp, const Eigen::MatrixXd& weights_and_norms, const Eigen::MatrixXd& reduction) {
    const auto inputs = static_cast<std::size_t>(gp.pseudo_inputs.rows());
    const auto outputs = static_cast<std::size_t>(gp.mean.size());
    const std::size_t columns = padded(static_cast<std::size_t>(gp.pseudo_inputs.cols()));
    lines.resize((padded(inputs) + padded(outputs) + (inputs + outputs + 1) * columns + numbers_in_panels(columns)) /
                 kColumnPadding);
    double* const inverse_length_scales = lines.front().numbers;
    double* const mean = inverse_length_scales + padded(inputs);
    double* const points = mean + padded(outputs);
    double* const weights = points + inputs * columns;
    double* const panels = weights + (outputs + 1) * columns;
    copy_padded(gp.kernel.length_scales.cwiseInverse(), inverse_length_scales, padded(inputs));
    copy_padded(gp.mean, mean, padded(outputs));
    copy_padded(gp.pseudo_inputs.transpose(), points, columns);
    copy_padded(weights_and_norms, weights, columns);
    copy_in_panels(reduction, panels, columns);
    view = {
        {inputs, columns, points, inverse_length_scales, gp.kernel.signal_variance}, outputs, mean, weights, panels};
  }
  PosteriorTables(const PosteriorTables&) = delete;  // the view points into the lines

  std::vector<Line> lines;
  PosteriorView view;
};

}  // namespace detail

Posterior::Posterior(const SparseGp& gp)
    : signal_variance_(gp.kernel.signal_variance),
      noise_variance_(gp.noise_variance),
      inputs_(static_cast<std::size_t>(gp.pseudo_inputs.rows())),
      outputs_(static_cast<std::size_t>(gp.mean.size())) {
  validate(gp);
  const Eigen::MatrixXd lower = detail::lower_factor(gp, "posterior");
  const Eigen::MatrixXd b_reversed = reversed_factor_of_b(gp.information);
  Eigen::MatrixXd reduction = reduction_factor(b_reversed);
  lower.triangularView<Eigen::Lower>().solveInPlace<Eigen::OnTheRight>(reduction);
  Eigen::MatrixXd weights_and_norms(gp.pseudo_inputs.cols(), gp.mean.size() + 1);
  weights_and_norms << weights_of(gp, lower, b_reversed), reduction.colwise().norm().transpose();
  tables_ = std::make_shared<const detail::PosteriorTables>(gp, weights_and_norms, reduction);
}

std::optional<double> Posterior::predict(std::span<const double> x, std::span<double> mean, double least_share) const {
  require_input(*this, x);
  if (mean.size() != outputs())
    throw invalid_argument("posterior: mean has size ", mean.size(), ", must have ", outputs());
  const detail::PosteriorView& view = tables_->view;
  KernelVector k(view, x.data());
  if (explained_share_bound(view, detail::sum_of_norms(view, k.data())) < kRoundingMargin * least_share)
    return std::nullopt;
  detail::means(view, k.data(), mean.data());
  return variance_left(view, k.data());
}

FieldPrediction Posterior::predict_flow(const Eigen::Vector2d& x) const {
  require_flow(*this, x);
  KernelVector k(tables_->view, x.data());
  return flow_at(tables_->view, k.data());
}

FieldLinearisation Posterior::linearise_flow(const Eigen::Vector2d& x) const {
  require_flow(*this, x);
  const detail::PosteriorView& view = tables_->view;
  KernelVector k(view, x.data());
  Eigen::Matrix<double, 2, 2, Eigen::RowMajor> jacobian;
  detail::jacobian(view, x.data(), k.data(), jacobian.data());
  return {flow_at(view, k.data()), jacobian};
}

std::vector<FieldPrediction> Posterior::bound_flows(std::span<const double> xs, std::span<const double> ys,
                                                    std::span<const RasterIndex> points) const {
  if (points.empty()) return {};
  const auto [first_x, count_x] = used<&RasterIndex::column>(points);
  const auto [first_y, count_y] = used<&RasterIndex::row>(points);
  if (first_x + count_x > xs.size() || first_y + count_y > ys.size())
    throw invalid_argument("posterior: a point is outside the raster of ", xs.size(), " x ", ys.size());
  for (const double x : xs.subspan(first_x, count_x)) require_flow(*this, {x, ys[first_y]});
  for (const double y : ys.subspan(first_y, count_y)) require_flow(*this, {xs[first_x], y});
  const detail::PosteriorView& view = tables_->view;
  const KernelFactors along_x(view, 0, signal_variance_, xs.subspan(first_x, count_x), first_x);
  const KernelFactors along_y(view, 1, 1.0, ys.subspan(first_y, count_y), first_y);
  std::vector<FieldPrediction> flows;
  flows.reserve(points.size());
  for (const RasterIndex& point : points) {
    std::array<double, 3> sums;
    detail::means_and_norms_of_product(view, along_x.at(point.column), along_y.at(point.row), sums.data());
    const double unexplained = std::max(0.0, 1.0 - explained_share_bound(view, sums[2]));
    flows.push_back({{sums[0], sums[1]}, Eigen::Vector2d::Constant(signal_variance_ * unexplained)});
  }
  return flows;
}

}  // namespace sila
