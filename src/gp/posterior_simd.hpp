#pragma once

#include <cstddef>

namespace sila::detail {

/// Columns are padded with zeros to a multiple of this, so that loops over vector registers need no tail: the widest
/// register holds 8 doubles.
inline constexpr std::size_t kColumnPadding = 8;
inline constexpr std::size_t padded(std::size_t size) {
  return (size + kColumnPadding - 1) / kColumnPadding * kColumnPadding;
}

/// A lower triangle is stored in panels of this number of rows, one after another; each column by column up to the
/// diagonal, padded with zeros.
inline constexpr std::size_t kPanelRows = 16;
/// Columns of the panel that begins with this row.
inline std::size_t panel_columns(std::size_t row, std::size_t columns) {
  return row + kPanelRows < columns ? row + kPanelRows : columns;
}

/// The points of one side of a kernel. Shapes: `points` inputs x columns, row by row; `columns` is padded.
struct KernelView {
  std::size_t inputs = 0, columns = 0;
  const double* points = nullptr;
  const double* inverse_length_scales = nullptr;
  double signal_variance = 1.0;
};

/// The tables of a posterior; its points are the pseudo-inputs. Shapes: `mean` outputs; `weights` (outputs + 1) x
/// columns, row by row; the last row holds the norms of the columns of `reduction`, a lower triangle of `columns` rows
/// and columns, in panels.
struct PosteriorView : KernelView {
  std::size_t outputs = 0;
  const double* mean = nullptr;
  const double* weights = nullptr;
  const double* reduction = nullptr;
};

/// k(points, x). Shapes: x has `inputs` entries, k has room for `columns`.
void kernel_vector(const KernelView& view, const double* x, double* k);
/// mean + weights' k. Shapes: sums has room for `outputs`.
void means(const PosteriorView& view, const double* k, double* sums);
/// The sum over the columns of |column of reduction| k.
double sum_of_norms(const PosteriorView& view, const double* k);
/// The means of two outputs, then the sum of norms, for k = a b entry by entry. Shapes: sums has room for 3.
void means_and_norms_of_product(const PosteriorView& view, const double* a, const double* b, double* sums);
/// d mean(p) / d x(d) at jacobian[p * inputs + d].
void jacobian(const PosteriorView& view, const double* x, const double* k, double* jacobian);
/// |reduction k|^2.
double explained_variance(const PosteriorView& view, const double* k);

}  // namespace sila::detail
