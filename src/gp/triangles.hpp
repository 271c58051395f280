#pragma once

#include "padded_matrix.hpp"

/// Algebra of matrices as small as a sparse GP's, 4 to 256 rows, and of triangles above all: a general library spends
/// most of its time here on what large matrices need, computes the zeros of triangles, too, and takes no wider vector
/// registers than every processor has (docs/decisions/0013). Shapes agree, padding included; nothing is checked.
namespace sila::detail {

enum class Part { whole, lower };

/// The lower triangle of A = L L' becomes L; what is above it does not count, and becomes zeros. False: A is not
/// positive definite, and what is left of it of no use.
[[nodiscard]] bool to_cholesky_factor(PaddedMatrix& a);
/// I - (L L')^-1; of the result only the lower triangle counts.
PaddedMatrix identity_minus_inverse(const PaddedMatrix& lower);
/// Y -> Y L^-1 for a lower triangle Y.
void divide_triangle(PaddedMatrix& y, const PaddedMatrix& lower);

/// X -> L^-1 X.
void divide_from_left(PaddedMatrix& x, const PaddedMatrix& lower);
/// X -> X L^-T.
void divide_by_transposed(PaddedMatrix& x, const PaddedMatrix& lower);
/// X -> L^-T X, each column for itself: for few columns.
void divide_vectors_transposed(PaddedMatrix& x, const PaddedMatrix& lower);

/// From column j of A the columns before it, each as often as its entry of this row says.
void take_columns_before(PaddedMatrix& a, std::size_t j, std::size_t row);

/// C -> C - A B, or only its lower triangle.
void take_product(PaddedMatrix& c, const PaddedMatrix& a, const PaddedMatrix& b, Part part);

/// A B, or only its lower triangle.
PaddedMatrix product(const PaddedMatrix& a, const PaddedMatrix& b, Part part = Part::whole);

}  // namespace sila::detail
