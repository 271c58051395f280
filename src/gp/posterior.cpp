#include "sila/gp/posterior.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "posterior_simd.hpp"
#include "sila/core/errors.hpp"
#include "statistics.hpp"
#include "triangles.hpp"

namespace sila {
namespace {

using detail::PaddedMatrix;

/// What is hardly below a bound may be above it but for rounding.
constexpr double kRoundingMargin = 1.0 - 1e-9;
/// Shares of the signal variance by which a variance may be too small.
constexpr double least_added = 1e-14, most_added = 1e-3;

/// Copies a matrix, column by column, to where columns have so many rows; what is beyond it stays.
void copy_padded(const Eigen::Ref<const Eigen::MatrixXd>& matrix, double* to, std::size_t rows) {
  for (Eigen::Index j = 0; j < matrix.cols(); ++j, to += rows) Eigen::VectorXd::Map(to, matrix.rows()) = matrix.col(j);
}

/// Copies a lower triangle into panels, as far as its rows and columns go.
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

/// S, a lower triangle, with S'S = I - B^-1, from the factor of B read backwards: so S read backwards is the transpose
/// of a Cholesky factor. Of directions in which nothing was seen the difference is rounding, of either sign; so little
/// is added to the diagonal, and no more, that a factor exists.
PaddedMatrix factor_of_the_explained(const PaddedMatrix& seen_backwards) {
  const PaddedMatrix explained = detail::identity_minus_inverse(seen_backwards);
  for (double more = least_added; more <= most_added; more *= 10.0) {
    PaddedMatrix backwards = explained;
    backwards.matrix().diagonal().array() += more;
    if (detail::to_cholesky_factor(backwards)) return detail::transposed_backwards(backwards);
  }
  throw NumericalError("posterior: what " + std::to_string(explained.rows()) +
                       " pseudo-inputs explain has no Cholesky factor");
}

/// The factor of B = I + information, read backwards.
PaddedMatrix factor_of_the_seen(const Eigen::MatrixXd& information) {
  PaddedMatrix seen = PaddedMatrix::backwards(information);
  seen.matrix().diagonal().array() += 1.0;
  if (detail::to_cholesky_factor(seen)) return seen;
  throw NumericalError("posterior: I + information of " + std::to_string(information.rows()) +
                       " pseudo-inputs has no Cholesky factor");
}

/// L_u^-T B^-1 response.
Eigen::MatrixXd weights_of(const SparseGp& gp, const PaddedMatrix& lower, const PaddedMatrix& seen_backwards) {
  PaddedMatrix backwards = PaddedMatrix::upside_down(gp.response);
  detail::divide_from_left(backwards, seen_backwards), detail::divide_vectors_transposed(backwards, seen_backwards);
  PaddedMatrix weights = PaddedMatrix::upside_down(backwards.matrix());
  detail::divide_vectors_transposed(weights, lower);
  return weights.matrix();
}

/// Which of the doubles each table begins with.
struct Layout {
  std::size_t mean, points, weights, reduction, end;

  Layout(std::size_t inputs, std::size_t outputs, std::size_t columns)
      : mean(detail::padded(inputs, detail::kColumnPadding)),
        points(mean + detail::padded(outputs, detail::kColumnPadding)),
        weights(points + inputs * columns),
        reduction(weights + (outputs + 1) * columns),
        end(reduction + numbers_in_panels(columns)) {}
};

/// k(Z, x), on the stack unless there are very many pseudo-inputs.
class Similarities {
 public:
  Similarities(const detail::PosteriorView& view, const double* x) {
    if (view.columns > stack_.size()) heap_.resize(view.columns);
    detail::similarities(view, x, data());
  }
  double* data() { return heap_.empty() ? stack_.data() : heap_.data(); }

 private:
  alignas(64) std::array<double, Posterior::max_stack_pseudo_inputs> stack_;
  std::vector<double> heap_;
};

Eigen::Vector2d flow_at(const detail::PosteriorView& view, const double* k) {
  Eigen::Vector2d flow;
  detail::means(view, k, flow.data());
  return flow;
}

Eigen::Matrix2d jacobian_at(const detail::PosteriorView& view, const Eigen::Vector2d& x, const double* k) {
  Eigen::Matrix<double, 2, 2, Eigen::RowMajor> jacobian;
  detail::slopes(view, x.data(), k, jacobian.data());
  return jacobian;
}

/// k(Z, x) for each of the values of one input, one after another, with this signal variance.
class AlongInput {
 public:
  AlongInput(const detail::PosteriorView& view, std::size_t input, double signal_variance,
             std::span<const double> values, std::size_t first)
      : first_(first), columns_(view.columns), numbers_(values.size() * view.columns) {
    const detail::KernelView one{1, columns_, view.points + input * columns_, view.inverse_length_scales + input,
                                 signal_variance};
    for (std::size_t i = 0; i < values.size(); ++i) detail::similarities(one, &values[i], &numbers_[i * columns_]);
  }
  const double* at(std::size_t value) const { return numbers_.data() + (value - first_) * columns_; }

 private:
  std::size_t first_, columns_;
  std::vector<double> numbers_;
};

/// The values between the least and the greatest that places stand at.
template <std::size_t RasterPlace::*Index>
std::pair<std::size_t, std::size_t> used(std::span<const RasterPlace> places) {
  const auto [least, greatest] = std::ranges::minmax(places, {}, Index);
  return {least.*Index, greatest.*Index + 1 - least.*Index};
}

double explained_at_most(const detail::PosteriorView& view, double sum_of_norms) {
  return sum_of_norms * sum_of_norms / view.signal_variance;
}

double variance_left(const detail::PosteriorView& view, const double* k) {
  return std::max(0.0, view.signal_variance - detail::explained_variance(view, k));
}

}  // namespace

Posterior::Posterior(const SparseGp& gp)
    : signal_variance_(gp.kernel.signal_variance),
      noise_variance_(gp.noise_variance),
      inputs_(static_cast<std::size_t>(gp.pseudo_inputs.rows())),
      outputs_(static_cast<std::size_t>(gp.mean.size())) {
  validate(gp);
  const Eigen::Index size = gp.pseudo_inputs.cols();
  const PaddedMatrix lower = detail::lower_factor(gp, "posterior");
  const PaddedMatrix seen_backwards = factor_of_the_seen(gp.information);
  PaddedMatrix reduction = factor_of_the_explained(seen_backwards);
  detail::divide_triangle(reduction, lower);

  Eigen::MatrixXd weights_and_norms(size, gp.mean.size() + 1);
  weights_and_norms << weights_of(gp, lower, seen_backwards), reduction.matrix().colwise().norm().transpose();

  columns_ = detail::padded(static_cast<std::size_t>(size), detail::kColumnPadding);
  const Layout layout(inputs_, outputs_, columns_);
  static_assert(sizeof(Line) == detail::kColumnPadding * sizeof(double));
  const auto tables = std::make_shared<std::vector<Line>>(layout.end / detail::kColumnPadding);
  tables_ = tables;
  double* const first = tables->front().numbers;
  copy_padded(gp.kernel.length_scales.cwiseInverse(), first, layout.mean);
  copy_padded(gp.mean, first + layout.mean, layout.points - layout.mean);
  copy_padded(gp.pseudo_inputs.transpose(), first + layout.points, columns_);
  copy_padded(weights_and_norms, first + layout.weights, columns_);
  copy_in_panels(reduction.matrix(), first + layout.reduction, columns_);
}

detail::PosteriorView Posterior::view() const {
  const Layout layout(inputs_, outputs_, columns_);
  const double* const first = tables_->front().numbers;
  return {{inputs_, columns_, first + layout.points, first, signal_variance_},
          outputs_,
          first + layout.mean,
          first + layout.weights,
          first + layout.reduction};
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

double Posterior::predict(std::span<const double> x, std::span<double> mean) const {
  require_input(x), require_output(mean);
  const detail::PosteriorView tables = view();
  Similarities k(tables, x.data());
  detail::means(tables, k.data(), mean.data());
  return variance_left(tables, k.data());
}

double Posterior::most_explained(std::span<const double> x) const {
  require_input(x);
  const detail::PosteriorView tables = view();
  Similarities k(tables, x.data());
  return explained_at_most(tables, detail::sum_of_norms(tables, k.data()));
}

std::optional<double> Posterior::predict_where_known(std::span<const double> x, std::span<double> mean,
                                                     double share) const {
  require_input(x), require_output(mean);
  const detail::PosteriorView tables = view();
  Similarities k(tables, x.data());
  if (explained_at_most(tables, detail::sum_of_norms(tables, k.data())) < kRoundingMargin * share) return std::nullopt;
  detail::means(tables, k.data(), mean.data());
  return variance_left(tables, k.data());
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
  const detail::PosteriorView tables = view();
  Similarities k(tables, x.data());
  return {flow_at(tables, k.data()), variance_left(tables, k.data())};
}

void Posterior::score_flow(std::span<const double> xs, std::span<const double> ys, std::span<const RasterPlace> places,
                           std::span<FlowPrediction> summaries) const {
  if (places.empty()) return;
  const auto [first_x, count_x] = used<&RasterPlace::column>(places);
  const auto [first_y, count_y] = used<&RasterPlace::row>(places);
  if (first_x + count_x > xs.size() || first_y + count_y > ys.size() || summaries.size() != places.size())
    throw std::invalid_argument("posterior: a place is beyond the raster, or scores are not as many as places");
  for (const double x : xs.subspan(first_x, count_x)) require_flow({x, ys[first_y]});
  for (const double y : ys.subspan(first_y, count_y)) require_flow({xs[first_x], y});
  const detail::PosteriorView tables = view();
  const AlongInput along_x(tables, 0, signal_variance_, xs.subspan(first_x, count_x), first_x);
  const AlongInput along_y(tables, 1, 1.0, ys.subspan(first_y, count_y), first_y);
  for (std::size_t i = 0; i < places.size(); ++i) {
    std::array<double, 3> sums;
    detail::means_and_norms_of_product(tables, along_x.at(places[i].column), along_y.at(places[i].row), sums.data());
    summaries[i] = {{sums[0], sums[1]}, signal_variance_ * std::max(0.0, 1.0 - explained_at_most(tables, sums[2]))};
  }
}

Eigen::Vector2d Posterior::flow_mean(const Eigen::Vector2d& x) const {
  require_flow(x);
  const detail::PosteriorView tables = view();
  Similarities k(tables, x.data());
  return flow_at(tables, k.data());
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
  return {{flow_at(tables, k.data()), variance_left(tables, k.data())}, jacobian_at(tables, x, k.data())};
}

}  // namespace sila
