#pragma once

#include <cstddef>

namespace sila::detail {

/// Rows and columns of tables are padded with zeros to multiples of these, so that loops over vector registers need no
/// tail: the widest register holds 8 doubles.
inline constexpr std::size_t kColumnPadding = 8;
inline constexpr std::size_t kRowPadding = 16;
inline std::size_t padded(std::size_t size, std::size_t multiple) {
  return (size + multiple - 1) / multiple * multiple;
}

/// Where the points of one side of a kernel lie. Shapes: `points` inputs x columns, row by row; `columns` is padded.
struct KernelView {
  std::size_t inputs = 0, columns = 0;
  const double* points = nullptr;
  const double* inverse_length_scales = nullptr;
  double signal_variance = 1.0;
  std::size_t first = 0;  ///< columns before this are left out; a multiple of the padding
};

/// Where the numbers of a posterior lie; its points are the pseudo-inputs. Shapes: `mean` outputs; `weights` (outputs +
/// 1) x columns, row by row, of which the last are the norms of the columns of `reduction`; this, a lower triangle,
/// columns x rows, column by column. `rows` is padded.
struct PosteriorView : KernelView {
  std::size_t outputs = 0, rows = 0;
  const double* mean = nullptr;
  const double* weights = nullptr;
  const double* reduction = nullptr;
};

/// k(points, x). Shapes: x has `inputs` entries, k has room for `columns`.
void similarities(const KernelView& view, const double* x, double* k);
/// mean + weights' k. Shapes: sums has room for `outputs`.
void means(const PosteriorView& view, const double* k, double* sums);
/// The sum over the columns of |column of reduction| k.
double sum_of_norms(const PosteriorView& view, const double* k);
/// Both of two outputs, this behind the means, with k = a b, entry by entry. Shapes: sums has room for 3.
void means_and_norms_of_product(const PosteriorView& view, const double* a, const double* b, double* sums);
/// d mean(p) / d x(d) at jacobian[p * inputs + d].
void slopes(const PosteriorView& view, const double* x, const double* k, double* jacobian);
/// |reduction k|^2.
double explained_variance(const PosteriorView& view, const double* k);

}  // namespace sila::detail
