// Matrices in panels of four columns. All that costs a third power of the size is one loop over vector registers,
// compiled once for each width of them; Highway takes the widest that the processor has when the program runs.

#include <algorithm>
#include <cmath>

#include "posterior_simd.hpp"
#include "triangles.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "triangles_simd.cpp"
// What defines the targets comes first.
// clang-format off
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// clang-format on

HWY_BEFORE_NAMESPACE();
namespace sila::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kPanel = PaddedMatrix::kPanel;
// No register is longer than a panel is wide, so none reaches from one panel's rows into another's.
using Tag = hn::CappedTag<double, kPanel>;

std::size_t panel_begin(std::size_t index) {
  return index / kPanel * kPanel;
}

/// One number for each column of a panel.
struct Shares {
  double of[kPanel];
};

HWY_INLINE Shares in_row(const PaddedMatrix& matrix, std::size_t row, std::size_t panel) {
  return {{matrix.column(panel)[row], matrix.column(panel + 1)[row], matrix.column(panel + 2)[row],
           matrix.column(panel + 3)[row]}};
}

HWY_INLINE Shares in_column(const double* rows) {
  return {{rows[0], rows[1], rows[2], rows[3]}};
}

/// From columns `to` and `to` + 1 of a matrix, rows begin to end, their shares of the columns of a panel.
HWY_INLINE void take_panel(const PaddedMatrix& from, std::size_t panel, const Shares& first, const Shares& second,
                           PaddedMatrix& matrix, std::size_t to, std::size_t begin, std::size_t end) {
  const Tag d;
  const auto a_0 = hn::Set(d, first.of[0]), a_1 = hn::Set(d, first.of[1]);
  const auto a_2 = hn::Set(d, first.of[2]), a_3 = hn::Set(d, first.of[3]);
  const auto b_0 = hn::Set(d, second.of[0]), b_1 = hn::Set(d, second.of[1]);
  const auto b_2 = hn::Set(d, second.of[2]), b_3 = hn::Set(d, second.of[3]);
  const double* const p = from.column(panel);
  const std::size_t stride = from.stride();
  double *const a = matrix.column(to), *const b = matrix.column(to + 1);
  for (std::size_t row = begin; row < end; row += hn::Lanes(d)) {
    const auto p_0 = hn::LoadU(d, p + row), p_1 = hn::LoadU(d, p + stride + row);
    const auto p_2 = hn::LoadU(d, p + 2 * stride + row), p_3 = hn::LoadU(d, p + 3 * stride + row);
    auto at_a = hn::NegMulAdd(p_0, a_0, hn::LoadU(d, a + row)), at_b = hn::NegMulAdd(p_0, b_0, hn::LoadU(d, b + row));
    at_a = hn::NegMulAdd(p_1, a_1, at_a), at_b = hn::NegMulAdd(p_1, b_1, at_b);
    at_a = hn::NegMulAdd(p_2, a_2, at_a), at_b = hn::NegMulAdd(p_2, b_2, at_b);
    at_a = hn::NegMulAdd(p_3, a_3, at_a), at_b = hn::NegMulAdd(p_3, b_3, at_b);
    hn::StoreU(at_a, d, a + row), hn::StoreU(at_b, d, b + row);
  }
}

/// From one column, rows begin to end, its shares of the columns of a panel.
HWY_INLINE void take_panel(const PaddedMatrix& from, std::size_t panel, const Shares& shares, double* to,
                           std::size_t begin, std::size_t end) {
  const Tag d;
  const auto s_0 = hn::Set(d, shares.of[0]), s_1 = hn::Set(d, shares.of[1]);
  const auto s_2 = hn::Set(d, shares.of[2]), s_3 = hn::Set(d, shares.of[3]);
  const double* const p = from.column(panel);
  const std::size_t stride = from.stride();
  for (std::size_t row = begin; row < end; row += hn::Lanes(d)) {
    auto here = hn::NegMulAdd(hn::LoadU(d, p + row), s_0, hn::LoadU(d, to + row));
    here = hn::NegMulAdd(hn::LoadU(d, p + stride + row), s_1, here);
    here = hn::NegMulAdd(hn::LoadU(d, p + 2 * stride + row), s_2, here);
    hn::StoreU(hn::NegMulAdd(hn::LoadU(d, p + 3 * stride + row), s_3, here), d, to + row);
  }
}

/// From one column, rows begin to end, its share of another.
HWY_INLINE void take_column(const double* column, double share, double* to, std::size_t begin, std::size_t end) {
  const Tag d;
  const auto factor = hn::Set(d, share);
  for (std::size_t row = begin; row < end; row += hn::Lanes(d))
    hn::StoreU(hn::NegMulAdd(hn::LoadU(d, column + row), factor, hn::LoadU(d, to + row)), d, to + row);
}

HWY_INLINE void scale(double* column, double factor, std::size_t begin, std::size_t end) {
  const Tag d;
  for (std::size_t row = begin; row < end; row += hn::Lanes(d))
    hn::StoreU(hn::Mul(hn::LoadU(d, column + row), hn::Set(d, factor)), d, column + row);
}

/// The inverse of the lower triangle where a panel meets the diagonal: who divides by it often multiplies instead, and
/// no row waits for the division of the one before.
struct Corner {
  double column[kPanel][kPanel] = {};
};

HWY_INLINE Corner inverse_corner(const PaddedMatrix& lower, std::size_t panel) {
  Corner inverse;
  for (std::size_t j = 0; j < kPanel; ++j) inverse.column[j][j] = 1.0 / lower.column(panel + j)[panel + j];
  for (std::size_t j = 0; j < kPanel; ++j) {
    for (std::size_t row = j + 1; row < kPanel; ++row) {
      double sum = 0.0;
      for (std::size_t k = j; k < row; ++k) sum += lower.column(panel + k)[panel + row] * inverse.column[j][k];
      inverse.column[j][row] = -sum * inverse.column[row][row];
    }
  }
  return inverse;
}

/// The rows of a panel -> C times these.
HWY_INLINE void multiply(const Corner& corner, double* rows) {
  const Tag d;
  const Shares shares = in_column(rows);
  for (std::size_t row = 0; row < kPanel; row += hn::Lanes(d)) {
    auto sum = hn::Mul(hn::LoadU(d, corner.column[0] + row), hn::Set(d, shares.of[0]));
    sum = hn::MulAdd(hn::LoadU(d, corner.column[1] + row), hn::Set(d, shares.of[1]), sum);
    sum = hn::MulAdd(hn::LoadU(d, corner.column[2] + row), hn::Set(d, shares.of[2]), sum);
    hn::StoreU(hn::MulAdd(hn::LoadU(d, corner.column[3] + row), hn::Set(d, shares.of[3]), sum), d, rows + row);
  }
}

/// The rows of a panel -> C' times these.
void multiply_transposed(const Corner& corner, double* rows) {
  for (std::size_t j = 0; j < kPanel; ++j) {
    double sum = 0.0;
    for (std::size_t k = j; k < kPanel; ++k) sum += corner.column[j][k] * rows[k];
    rows[j] = sum;
  }
}

bool cholesky_factor(PaddedMatrix& a) {
  const std::size_t size = a.padded_rows();
  for (std::size_t panel = 0; panel < size; panel += kPanel) {
    for (std::size_t j = panel; j < panel + kPanel; ++j) {
      double* const column = a.column(j);
      for (std::size_t k = panel; k < j; ++k) take_column(a.column(k), a.column(k)[j], column, panel, size);
      if (!(column[j] > 0.0)) return false;
      scale(column, 1.0 / std::sqrt(column[j]), panel, size);
    }
    for (std::size_t j = panel + kPanel; j < size; j += 2)
      take_panel(a, panel, in_row(a, j, panel), in_row(a, j + 1, panel), a, j, panel_begin(j), size);
  }
  return true;
}

/// X -> L^-1 X, two columns at a time. Of a triangle X only so many columns as the row has are not zero.
void divide_columns(PaddedMatrix& x, const PaddedMatrix& lower, Part part) {
  const std::size_t all = padded(static_cast<std::size_t>(x.columns()), 2);
  for (std::size_t panel = 0; panel < lower.padded_rows(); panel += kPanel) {
    const std::size_t next = panel + kPanel, columns = part == Part::lower ? next : all;
    const Corner corner = inverse_corner(lower, panel);
    for (std::size_t j = 0; j < columns; ++j) multiply(corner, x.column(j) + panel);
    for (std::size_t j = 0; j < columns; j += 2) {
      take_panel(lower, panel, in_column(x.column(j) + panel), in_column(x.column(j + 1) + panel), x, j, next,
                 lower.padded_rows());
    }
  }
}

/// X -> X L^-T.
void divide_rows_transposed(PaddedMatrix& x, const PaddedMatrix& lower) {
  const std::size_t size = lower.padded_rows(), rows = x.padded_rows();
  for (std::size_t panel = 0; panel < size; panel += kPanel) {
    for (std::size_t j = panel; j < panel + kPanel; ++j) {
      for (std::size_t k = panel; k < j; ++k) take_column(x.column(k), lower.column(k)[j], x.column(j), 0, rows);
      scale(x.column(j), 1.0 / lower.column(j)[j], 0, rows);
    }
    for (std::size_t j = panel + kPanel; j < size; j += 2)
      take_panel(x, panel, in_row(lower, j, panel), in_row(lower, j + 1, panel), x, j, 0, rows);
  }
}

/// Y -> Y L^-1 for a lower triangle Y, the last column first.
void divide_rows(PaddedMatrix& y, const PaddedMatrix& lower) {
  const std::size_t size = lower.padded_rows();
  for (std::size_t next = size; next > 0; next -= kPanel) {
    const std::size_t panel = next - kPanel;
    for (std::size_t j = next; j-- > panel;) {
      for (std::size_t k = j + 1; k < next; ++k) take_column(y.column(k), lower.column(j)[k], y.column(j), panel, size);
      scale(y.column(j), 1.0 / lower.column(j)[j], panel, size);
    }
    for (std::size_t j = 0; j < panel; j += 2) {
      take_panel(y, panel, in_column(lower.column(j) + panel), in_column(lower.column(j + 1) + panel), y, j, panel,
                 size);
    }
  }
}

/// A -> A - U U' for an upper triangle U; only the lower triangle of A is found.
void take_square(PaddedMatrix& a, const PaddedMatrix& upper) {
  for (std::size_t panel = 0; panel < upper.padded_columns(); panel += kPanel) {
    for (std::size_t j = 0; j < panel + kPanel; j += 2) {
      take_panel(upper, panel, in_row(upper, j, panel), in_row(upper, j + 1, panel), a, j, panel_begin(j),
                 panel + kPanel);
    }
  }
}

/// C -> C - A B, or only its lower triangle.
void take_product(PaddedMatrix& c, const PaddedMatrix& a, const PaddedMatrix& b, Part part) {
  for (std::size_t panel = 0; panel < a.padded_columns(); panel += kPanel) {
    for (std::size_t j = 0; j < c.padded_columns(); j += 2) {
      take_panel(a, panel, in_column(b.column(j) + panel), in_column(b.column(j + 1) + panel), c, j,
                 part == Part::lower ? panel_begin(j) : 0, c.padded_rows());
    }
  }
}

/// Panels first; the columns left over one by one.
void take_columns_before(PaddedMatrix& a, std::size_t j, std::size_t row) {
  const std::size_t panels = panel_begin(j);
  for (std::size_t panel = 0; panel < panels; panel += kPanel)
    take_panel(a, panel, in_row(a, row, panel), a.column(j), 0, a.padded_rows());
  for (std::size_t k = panels; k < j; ++k) take_column(a.column(k), a.column(k)[row], a.column(j), 0, a.padded_rows());
}

/// From rows `panel` on of a column, what the columns of a panel of L and the rows below it make.
HWY_INLINE void take_rows_below(const PaddedMatrix& lower, std::size_t panel, double* x) {
  const Tag d;
  auto sum_0 = hn::Zero(d), sum_1 = sum_0, sum_2 = sum_0, sum_3 = sum_0;
  const double* const p = lower.column(panel);
  const std::size_t stride = lower.stride();
  for (std::size_t row = panel + kPanel; row < lower.padded_rows(); row += hn::Lanes(d)) {
    const auto here = hn::LoadU(d, x + row);
    sum_0 = hn::MulAdd(hn::LoadU(d, p + row), here, sum_0);
    sum_1 = hn::MulAdd(hn::LoadU(d, p + stride + row), here, sum_1);
    sum_2 = hn::MulAdd(hn::LoadU(d, p + 2 * stride + row), here, sum_2);
    sum_3 = hn::MulAdd(hn::LoadU(d, p + 3 * stride + row), here, sum_3);
  }
  x[panel] -= hn::GetLane(hn::SumOfLanes(d, sum_0)), x[panel + 1] -= hn::GetLane(hn::SumOfLanes(d, sum_1));
  x[panel + 2] -= hn::GetLane(hn::SumOfLanes(d, sum_2)), x[panel + 3] -= hn::GetLane(hn::SumOfLanes(d, sum_3));
}

/// X -> L^-T X, one column after another.
void divide_vectors_transposed(PaddedMatrix& x, const PaddedMatrix& lower) {
  const auto columns = static_cast<std::size_t>(x.columns());
  for (std::size_t next = lower.padded_rows(); next > 0; next -= kPanel) {
    const std::size_t panel = next - kPanel;
    const Corner corner = inverse_corner(lower, panel);
    for (std::size_t j = 0; j < columns; ++j) {
      take_rows_below(lower, panel, x.column(j));
      multiply_transposed(corner, x.column(j) + panel);
    }
  }
}

}  // namespace sila::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sila::detail {

HWY_EXPORT(cholesky_factor);
HWY_EXPORT(divide_columns);
HWY_EXPORT(divide_rows_transposed);
HWY_EXPORT(divide_rows);
HWY_EXPORT(take_square);
HWY_EXPORT(take_product);
HWY_EXPORT(take_columns_before);
HWY_EXPORT(divide_vectors_transposed);

bool to_cholesky_factor(PaddedMatrix& a) {
  a.set_identity_behind();
  if (!HWY_DYNAMIC_DISPATCH(cholesky_factor)(a)) return false;
  for (std::size_t j = 1; j < a.padded_columns(); ++j) std::fill_n(a.column(j), j, 0.0);
  return true;
}

PaddedMatrix identity_minus_inverse(const PaddedMatrix& lower) {
  PaddedMatrix result(lower.rows(), lower.rows());
  for (std::size_t i = 0; i < result.padded_rows(); ++i) result.column(i)[i] = 1.0;
  PaddedMatrix root = result;
  HWY_DYNAMIC_DISPATCH(divide_columns)(root, lower, Part::lower);
  HWY_DYNAMIC_DISPATCH(take_square)(result, transposed(root));
  return result;
}

void divide_triangle(PaddedMatrix& y, const PaddedMatrix& lower) {
  HWY_DYNAMIC_DISPATCH(divide_rows)(y, lower);
}

void divide_from_left(PaddedMatrix& x, const PaddedMatrix& lower) {
  HWY_DYNAMIC_DISPATCH(divide_columns)(x, lower, Part::whole);
}

void divide_by_transposed(PaddedMatrix& x, const PaddedMatrix& lower) {
  HWY_DYNAMIC_DISPATCH(divide_rows_transposed)(x, lower);
}

void divide_vectors_transposed(PaddedMatrix& x, const PaddedMatrix& lower) {
  HWY_DYNAMIC_DISPATCH(divide_vectors_transposed)(x, lower);
}

void take_columns_before(PaddedMatrix& a, std::size_t j, std::size_t row) {
  HWY_DYNAMIC_DISPATCH(take_columns_before)(a, j, row);
}

void take_product(PaddedMatrix& c, const PaddedMatrix& a, const PaddedMatrix& b, Part part) {
  HWY_DYNAMIC_DISPATCH(take_product)(c, a, b, part);
}

PaddedMatrix product(const PaddedMatrix& a, const PaddedMatrix& b, Part part) {
  PaddedMatrix result(a.rows(), b.columns());
  HWY_DYNAMIC_DISPATCH(take_product)(result, a, b, part);
  result.matrix() *= -1.0;
  return result;
}

}  // namespace sila::detail
#endif
