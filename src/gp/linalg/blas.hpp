#pragma once

#include "padded_matrix.hpp"

/// The BLAS and LAPACK operations that sparse GPs need, for matrices of 4 to 256 rows and triangles above all, with the
/// widest vector registers of the processor (docs/decisions/0013). Shapes must agree, padding included; nothing is
/// checked. L is a lower triangle; A, C and X are overwritten.
namespace sila::detail {

/// A = L L' -> L, from the lower triangle of A; zeros above. False: A is not positive definite, and its content is then
/// undefined.
[[nodiscard]] bool potrf(PaddedMatrix& a);
/// L^-1.
PaddedMatrix trtri(const PaddedMatrix& lower);

/// X -> L^-1 X.
void trsm_left(PaddedMatrix& x, const PaddedMatrix& lower);
/// X -> L^-T X, column by column: for few columns.
void trsm_left_transposed(PaddedMatrix& x, const PaddedMatrix& lower);
/// X -> X L^-T.
void trsm_right_transposed(PaddedMatrix& x, const PaddedMatrix& lower);
/// X -> X L^-1 for a lower triangle X.
void trsm_right_triangular(PaddedMatrix& x, const PaddedMatrix& lower);

/// C -> C - A B.
void gemm(PaddedMatrix& c, const PaddedMatrix& a, const PaddedMatrix& b);
/// A B.
PaddedMatrix gemm(const PaddedMatrix& a, const PaddedMatrix& b);
/// Both, but only the lower triangle of the result is valid.
void gemmt(PaddedMatrix& c, const PaddedMatrix& a, const PaddedMatrix& b);
PaddedMatrix gemmt(const PaddedMatrix& a, const PaddedMatrix& b);
/// C -> C - L'L; only the lower triangle of C is valid.
void syrk_triangular(PaddedMatrix& c, const PaddedMatrix& lower);
/// Column j of A: a_j -> a_j - A(:, 0:j) A(row, 0:j)'.
void gemv_columns_before(PaddedMatrix& a, std::size_t j, std::size_t row);

}  // namespace sila::detail
