// Matrices in panels of four columns. The inner loops are compiled once for each width of vector registers; Highway
// takes the widest that the processor has when the program runs.

#include <algorithm>
#include <cmath>

#include "blas.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "blas_simd.cpp"
// The header that defines the targets must come first.
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
struct Coefficients {
  double of[kPanel];
};

HWY_INLINE Coefficients in_row(const PaddedMatrix& matrix, std::size_t row, std::size_t panel) {
  return {{matrix.column(panel)[row], matrix.column(panel + 1)[row], matrix.column(panel + 2)[row],
           matrix.column(panel + 3)[row]}};
}

HWY_INLINE Coefficients in_column(const double* rows) {
  return {{rows[0], rows[1], rows[2], rows[3]}};
}

/// Columns `to` and `to` + 1 of a matrix, rows begin to end: minus a linear combination of the columns of a panel each.
HWY_INLINE void subtract_panel(const PaddedMatrix& from, std::size_t panel, const Coefficients& first,
                               const Coefficients& second, PaddedMatrix& matrix, std::size_t to, std::size_t begin,
                               std::size_t end) {
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

/// One column, rows begin to end: minus a linear combination of the columns of a panel.
HWY_INLINE void subtract_panel(const PaddedMatrix& from, std::size_t panel, const Coefficients& by, double* to,
                               std::size_t begin, std::size_t end) {
  const Tag d;
  const auto s_0 = hn::Set(d, by.of[0]), s_1 = hn::Set(d, by.of[1]);
  const auto s_2 = hn::Set(d, by.of[2]), s_3 = hn::Set(d, by.of[3]);
  const double* const p = from.column(panel);
  const std::size_t stride = from.stride();
  for (std::size_t row = begin; row < end; row += hn::Lanes(d)) {
    auto here = hn::NegMulAdd(hn::LoadU(d, p + row), s_0, hn::LoadU(d, to + row));
    here = hn::NegMulAdd(hn::LoadU(d, p + stride + row), s_1, here);
    here = hn::NegMulAdd(hn::LoadU(d, p + 2 * stride + row), s_2, here);
    hn::StoreU(hn::NegMulAdd(hn::LoadU(d, p + 3 * stride + row), s_3, here), d, to + row);
  }
}

/// `to` -> `to` - factor * column, rows begin to end.
HWY_INLINE void axpy(const double* column, double factor, double* to, std::size_t begin, std::size_t end) {
  const Tag d;
  const auto by = hn::Set(d, factor);
  for (std::size_t row = begin; row < end; row += hn::Lanes(d))
    hn::StoreU(hn::NegMulAdd(hn::LoadU(d, column + row), by, hn::LoadU(d, to + row)), d, to + row);
}

HWY_INLINE void scal(double* column, double factor, std::size_t begin, std::size_t end) {
  const Tag d;
  for (std::size_t row = begin; row < end; row += hn::Lanes(d))
    hn::StoreU(hn::Mul(hn::LoadU(d, column + row), hn::Set(d, factor)), d, column + row);
}

/// The inverse of the diagonal block of a panel: multiplying by it avoids divisions that wait for one another.
struct DiagonalBlock {
  double column[kPanel][kPanel] = {};
};

HWY_INLINE DiagonalBlock inverse_diagonal_block(const PaddedMatrix& lower, std::size_t panel) {
  DiagonalBlock inverse;
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

/// The rows of a panel of one column -> block * rows.
HWY_INLINE void trmv(const DiagonalBlock& block, double* rows) {
  const Tag d;
  const Coefficients by = in_column(rows);
  for (std::size_t row = 0; row < kPanel; row += hn::Lanes(d)) {
    auto sum = hn::Mul(hn::LoadU(d, block.column[0] + row), hn::Set(d, by.of[0]));
    sum = hn::MulAdd(hn::LoadU(d, block.column[1] + row), hn::Set(d, by.of[1]), sum);
    sum = hn::MulAdd(hn::LoadU(d, block.column[2] + row), hn::Set(d, by.of[2]), sum);
    hn::StoreU(hn::MulAdd(hn::LoadU(d, block.column[3] + row), hn::Set(d, by.of[3]), sum), d, rows + row);
  }
}

/// The rows of a panel of one column -> block' * rows.
void trmv_transposed(const DiagonalBlock& block, double* rows) {
  for (std::size_t j = 0; j < kPanel; ++j) {
    double sum = 0.0;
    for (std::size_t k = j; k < kPanel; ++k) sum += block.column[j][k] * rows[k];
    rows[j] = sum;
  }
}

bool potrf_simd(PaddedMatrix& a) {
  const std::size_t size = a.padded_rows();
  for (std::size_t panel = 0; panel < size; panel += kPanel) {
    for (std::size_t j = panel; j < panel + kPanel; ++j) {
      double* const column = a.column(j);
      for (std::size_t k = panel; k < j; ++k) axpy(a.column(k), a.column(k)[j], column, panel, size);
      if (!(column[j] > 0.0)) return false;
      scal(column, 1.0 / std::sqrt(column[j]), panel, size);
    }
    for (std::size_t j = panel + kPanel; j < size; j += 2)
      subtract_panel(a, panel, in_row(a, j, panel), in_row(a, j + 1, panel), a, j, panel_begin(j), size);
  }
  return true;
}

/// X -> L^-1 X, two columns at a time. Of a lower triangle X, only columns up to the diagonal are not zero.
void trsm_left_simd(PaddedMatrix& x, const PaddedMatrix& lower, bool triangular) {
  const std::size_t all = padded(static_cast<std::size_t>(x.columns()), 2);
  for (std::size_t panel = 0; panel < lower.padded_rows(); panel += kPanel) {
    const std::size_t next = panel + kPanel, columns = triangular ? next : all;
    const DiagonalBlock block = inverse_diagonal_block(lower, panel);
    for (std::size_t j = 0; j < columns; ++j) trmv(block, x.column(j) + panel);
    for (std::size_t j = 0; j < columns; j += 2) {
      subtract_panel(lower, panel, in_column(x.column(j) + panel), in_column(x.column(j + 1) + panel), x, j, next,
                     lower.padded_rows());
    }
  }
}

/// X -> X L^-T.
void trsm_right_transposed_simd(PaddedMatrix& x, const PaddedMatrix& lower) {
  const std::size_t size = lower.padded_rows(), rows = x.padded_rows();
  for (std::size_t panel = 0; panel < size; panel += kPanel) {
    for (std::size_t j = panel; j < panel + kPanel; ++j) {
      for (std::size_t k = panel; k < j; ++k) axpy(x.column(k), lower.column(k)[j], x.column(j), 0, rows);
      scal(x.column(j), 1.0 / lower.column(j)[j], 0, rows);
    }
    for (std::size_t j = panel + kPanel; j < size; j += 2)
      subtract_panel(x, panel, in_row(lower, j, panel), in_row(lower, j + 1, panel), x, j, 0, rows);
  }
}

/// X -> X L^-1 for a lower triangle X, the last column first.
void trsm_right_triangular_simd(PaddedMatrix& x, const PaddedMatrix& lower) {
  const std::size_t size = lower.padded_rows();
  for (std::size_t next = size; next > 0; next -= kPanel) {
    const std::size_t panel = next - kPanel;
    for (std::size_t j = next; j-- > panel;) {
      for (std::size_t k = j + 1; k < next; ++k) axpy(x.column(k), lower.column(j)[k], x.column(j), panel, size);
      scal(x.column(j), 1.0 / lower.column(j)[j], panel, size);
    }
    for (std::size_t j = 0; j < panel; j += 2) {
      subtract_panel(x, panel, in_column(lower.column(j) + panel), in_column(lower.column(j + 1) + panel), x, j, panel,
                     size);
    }
  }
}

/// C -> C - A B. Each tile of two registers by four columns stays in registers for all columns of A. `lower`: tiles
/// above the diagonal are left out. `upper_a`: columns of A before the tile's rows, zero there, are left out.
void gemm_simd(PaddedMatrix& c, const PaddedMatrix& a, const PaddedMatrix& b, bool lower, bool upper_a) {
  if (a.padded_columns() == 0) return;  // no storage that a pointer could point into
  const Tag d;
  const std::size_t lanes = hn::Lanes(d), tile = 2 * lanes, stride = a.stride();
  for (std::size_t j = 0; j < c.padded_columns(); j += kPanel) {
    double *const c_0 = c.column(j), *const c_1 = c.column(j + 1), *const c_2 = c.column(j + 2),
                  *const c_3 = c.column(j + 3);
    const double *const b_0 = b.column(j), *const b_1 = b.column(j + 1), *const b_2 = b.column(j + 2),
                        *const b_3 = b.column(j + 3);
    for (std::size_t row = lower ? j / tile * tile : 0; row < c.padded_rows(); row += tile) {
      auto low_0 = hn::LoadU(d, c_0 + row), high_0 = hn::LoadU(d, c_0 + row + lanes);
      auto low_1 = hn::LoadU(d, c_1 + row), high_1 = hn::LoadU(d, c_1 + row + lanes);
      auto low_2 = hn::LoadU(d, c_2 + row), high_2 = hn::LoadU(d, c_2 + row + lanes);
      auto low_3 = hn::LoadU(d, c_3 + row), high_3 = hn::LoadU(d, c_3 + row + lanes);
      const std::size_t first = upper_a ? row : 0;
      const double* at = a.column(0) + first * stride + row;
      for (std::size_t k = first; k < a.padded_columns(); ++k, at += stride) {
        const auto low = hn::LoadU(d, at), high = hn::LoadU(d, at + lanes);
        const auto by_0 = hn::Set(d, b_0[k]), by_1 = hn::Set(d, b_1[k]);
        const auto by_2 = hn::Set(d, b_2[k]), by_3 = hn::Set(d, b_3[k]);
        low_0 = hn::NegMulAdd(low, by_0, low_0), high_0 = hn::NegMulAdd(high, by_0, high_0);
        low_1 = hn::NegMulAdd(low, by_1, low_1), high_1 = hn::NegMulAdd(high, by_1, high_1);
        low_2 = hn::NegMulAdd(low, by_2, low_2), high_2 = hn::NegMulAdd(high, by_2, high_2);
        low_3 = hn::NegMulAdd(low, by_3, low_3), high_3 = hn::NegMulAdd(high, by_3, high_3);
      }
      hn::StoreU(low_0, d, c_0 + row), hn::StoreU(high_0, d, c_0 + row + lanes);
      hn::StoreU(low_1, d, c_1 + row), hn::StoreU(high_1, d, c_1 + row + lanes);
      hn::StoreU(low_2, d, c_2 + row), hn::StoreU(high_2, d, c_2 + row + lanes);
      hn::StoreU(low_3, d, c_3 + row), hn::StoreU(high_3, d, c_3 + row + lanes);
    }
  }
}

/// Panels first, then the remaining columns one by one.
void gemv_columns_before_simd(PaddedMatrix& a, std::size_t j, std::size_t row) {
  const std::size_t panels = panel_begin(j);
  for (std::size_t panel = 0; panel < panels; panel += kPanel)
    subtract_panel(a, panel, in_row(a, row, panel), a.column(j), 0, a.padded_rows());
  for (std::size_t k = panels; k < j; ++k) axpy(a.column(k), a.column(k)[row], a.column(j), 0, a.padded_rows());
}

/// The rows of a panel of one column: minus L(below, panel)' times the rows below.
HWY_INLINE void subtract_rows_below(const PaddedMatrix& lower, std::size_t panel, double* x) {
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
  x[panel] -= hn::GetLane(hn::SumOfLanes(d, sum_0));
  x[panel + 1] -= hn::GetLane(hn::SumOfLanes(d, sum_1));
  x[panel + 2] -= hn::GetLane(hn::SumOfLanes(d, sum_2));
  x[panel + 3] -= hn::GetLane(hn::SumOfLanes(d, sum_3));
}

/// X -> L^-T X, one column after another.
void trsm_left_transposed_simd(PaddedMatrix& x, const PaddedMatrix& lower) {
  const auto columns = static_cast<std::size_t>(x.columns());
  for (std::size_t next = lower.padded_rows(); next > 0; next -= kPanel) {
    const std::size_t panel = next - kPanel;
    const DiagonalBlock block = inverse_diagonal_block(lower, panel);
    for (std::size_t j = 0; j < columns; ++j) {
      subtract_rows_below(lower, panel, x.column(j));
      trmv_transposed(block, x.column(j) + panel);
    }
  }
}

}  // namespace sila::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sila::detail {

HWY_EXPORT(potrf_simd);
HWY_EXPORT(trsm_left_simd);
HWY_EXPORT(trsm_left_transposed_simd);
HWY_EXPORT(trsm_right_transposed_simd);
HWY_EXPORT(trsm_right_triangular_simd);
HWY_EXPORT(gemm_simd);
HWY_EXPORT(gemv_columns_before_simd);

bool potrf(PaddedMatrix& a) {
  a.pad_with_identity();
  if (!HWY_DYNAMIC_DISPATCH(potrf_simd)(a)) return false;
  for (std::size_t j = 1; j < a.padded_columns(); ++j) std::fill_n(a.column(j), j, 0.0);
  return true;
}

PaddedMatrix trtri(const PaddedMatrix& lower) {
  PaddedMatrix inverse(lower.rows(), lower.rows());
  for (std::size_t i = 0; i < inverse.padded_rows(); ++i) inverse.column(i)[i] = 1.0;
  HWY_DYNAMIC_DISPATCH(trsm_left_simd)(inverse, lower, true);
  return inverse;
}

void trsm_left(PaddedMatrix& x, const PaddedMatrix& lower) {
  HWY_DYNAMIC_DISPATCH(trsm_left_simd)(x, lower, false);
}

void trsm_left_transposed(PaddedMatrix& x, const PaddedMatrix& lower) {
  HWY_DYNAMIC_DISPATCH(trsm_left_transposed_simd)(x, lower);
}

void trsm_right_transposed(PaddedMatrix& x, const PaddedMatrix& lower) {
  HWY_DYNAMIC_DISPATCH(trsm_right_transposed_simd)(x, lower);
}

void trsm_right_triangular(PaddedMatrix& x, const PaddedMatrix& lower) {
  HWY_DYNAMIC_DISPATCH(trsm_right_triangular_simd)(x, lower);
}

void gemm(PaddedMatrix& c, const PaddedMatrix& a, const PaddedMatrix& b) {
  HWY_DYNAMIC_DISPATCH(gemm_simd)(c, a, b, false, false);
}

void gemmt(PaddedMatrix& c, const PaddedMatrix& a, const PaddedMatrix& b) {
  HWY_DYNAMIC_DISPATCH(gemm_simd)(c, a, b, true, false);
}

PaddedMatrix gemm(const PaddedMatrix& a, const PaddedMatrix& b) {
  PaddedMatrix result(a.rows(), b.columns());
  gemm(result, a, b);
  result.matrix() *= -1.0;
  return result;
}

PaddedMatrix gemmt(const PaddedMatrix& a, const PaddedMatrix& b) {
  PaddedMatrix result(a.rows(), b.columns());
  gemmt(result, a, b);
  result.matrix() *= -1.0;
  return result;
}

void syrk_triangular(PaddedMatrix& c, const PaddedMatrix& lower) {
  HWY_DYNAMIC_DISPATCH(gemm_simd)(c, transposed(lower), lower, true, true);
}

void gemv_columns_before(PaddedMatrix& a, std::size_t j, std::size_t row) {
  HWY_DYNAMIC_DISPATCH(gemv_columns_before_simd)(a, j, row);
}

}  // namespace sila::detail
#endif
