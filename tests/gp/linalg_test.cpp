// src/gp/linalg against Eigen, for all sizes up to a few panels of columns and some larger ones.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <limits>
#include <random>
#include <vector>

#include "gp/linalg/blas.hpp"

namespace sila::detail {
namespace {

const std::vector<Eigen::Index> sizes{1, 2, 3, 4, 5, 7, 8, 9, 12, 15, 16, 17, 31, 33, 64, 90, 121};

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

/// Well enough conditioned for the bounds below.
Eigen::MatrixXd definite_matrix(Eigen::Index size, unsigned seed) {
  const Eigen::MatrixXd root = random_matrix(size, size, seed);
  return root * root.transpose() / static_cast<double>(size) + Eigen::MatrixXd::Identity(size, size);
}

Eigen::MatrixXd lower_of(const Eigen::MatrixXd& matrix) {
  return matrix.triangularView<Eigen::Lower>();
}

Eigen::MatrixXd lower_of(const PaddedMatrix& matrix) {
  return lower_of(Eigen::MatrixXd(matrix.matrix()));
}

Eigen::MatrixXd eigens_factor(const Eigen::MatrixXd& definite) {
  return Eigen::LLT<Eigen::MatrixXd>(definite).matrixL();
}

TEST(Linalg, PotrfIsEigensFactorWithZerosAboveTheDiagonal) {
  for (const Eigen::Index size : sizes) {
    SCOPED_TRACE(size);
    const Eigen::MatrixXd a = definite_matrix(size, 1);
    PaddedMatrix factor(a);
    ASSERT_TRUE(potrf(factor));
    EXPECT_LT((factor.matrix() - eigens_factor(a)).norm(), 1e-12);
    EXPECT_EQ(factor.matrix(), lower_of(factor));
  }
}

TEST(Linalg, PotrfRefusesAnIndefiniteMatrix) {
  for (const Eigen::Index size : sizes) {
    SCOPED_TRACE(size);
    Eigen::MatrixXd a = definite_matrix(size, 2);
    a(size - 1, size - 1) = -1e-6;
    PaddedMatrix indefinite(a);
    EXPECT_FALSE(potrf(indefinite));
    a(size - 1, size - 1) = std::numeric_limits<double>::quiet_NaN();
    PaddedMatrix unknown(a);
    EXPECT_FALSE(potrf(unknown));
  }
}

TEST(Linalg, TrtriAndSyrkGiveIdentityMinusInverse) {
  for (const Eigen::Index size : sizes) {
    SCOPED_TRACE(size);
    const Eigen::MatrixXd b = definite_matrix(size, 3);
    const Eigen::MatrixXd wanted = Eigen::MatrixXd::Identity(size, size) - b.inverse();
    PaddedMatrix found(size, size);
    found.matrix().diagonal().setOnes();
    syrk_triangular(found, trtri(PaddedMatrix::factor(eigens_factor(b))));
    EXPECT_LT((lower_of(found) - lower_of(wanted)).norm(), 1e-12);
  }
}

TEST(Linalg, TrsmUndoesProducts) {
  for (const Eigen::Index size : sizes) {
    SCOPED_TRACE(size);
    const Eigen::MatrixXd lower = eigens_factor(definite_matrix(size, 4));
    const PaddedMatrix padded = PaddedMatrix::factor(lower);
    const Eigen::MatrixXd triangle = lower_of(random_matrix(size, size, 5));
    PaddedMatrix y(triangle * lower);
    trsm_right_triangular(y, padded);
    EXPECT_LT((y.matrix() - triangle).norm(), 1e-11);
    for (const Eigen::Index others : {1, 2, 6, 33}) {
      SCOPED_TRACE(others);
      const Eigen::MatrixXd columns = random_matrix(size, others, 6), rows = random_matrix(others, size, 7);
      PaddedMatrix left(lower * columns), transposed_vectors(lower.transpose() * columns);
      PaddedMatrix right(rows * lower.transpose());
      trsm_left(left, padded);
      trsm_left_transposed(transposed_vectors, padded);
      trsm_right_transposed(right, padded);
      EXPECT_LT((left.matrix() - columns).norm(), 1e-11);
      EXPECT_LT((transposed_vectors.matrix() - columns).norm(), 1e-11);
      EXPECT_LT((right.matrix() - rows).norm(), 1e-11);
    }
  }
}

TEST(Linalg, GemmIsEigensProduct) {
  for (const Eigen::Index rows : sizes) {
    for (const Eigen::Index inner : {0, 1, 5, 20}) {
      SCOPED_TRACE(std::to_string(rows) + " x " + std::to_string(inner));
      const Eigen::MatrixXd a = random_matrix(rows, inner, 8), b = random_matrix(inner, rows, 9);
      const PaddedMatrix padded_a(a), padded_b(b);
      EXPECT_LT((gemm(padded_a, padded_b).matrix() - a * b).norm(), 1e-11);
      EXPECT_LT((lower_of(gemmt(padded_a, padded_b)) - lower_of(a * b)).norm(), 1e-11);
      const Eigen::MatrixXd c = random_matrix(rows, rows, 10);
      PaddedMatrix taken(c);
      gemm(taken, padded_a, padded_b);
      EXPECT_LT((taken.matrix() - (c - a * b)).norm(), 1e-11);
    }
  }
}

TEST(Linalg, GemvSubtractsTheColumnsBefore) {
  for (const Eigen::Index size : sizes) {
    const Eigen::MatrixXd a = random_matrix(size + 3, size, 11);
    for (Eigen::Index j = 0; j < size; j += 1 + j / 4) {
      SCOPED_TRACE(testing::Message() << size << ", " << j);
      const Eigen::Index row = (2 * j + 1) % (size + 3);
      PaddedMatrix taken(a);
      gemv_columns_before(taken, static_cast<std::size_t>(j), static_cast<std::size_t>(row));
      Eigen::MatrixXd wanted = a;
      wanted.col(j) -= a.leftCols(j) * a.row(row).head(j).transpose();
      EXPECT_LT((taken.matrix() - wanted).norm(), 1e-12 * static_cast<double>(size));
    }
  }
}

TEST(Linalg, TransposesAndReversesMoveEveryEntry) {
  for (const Eigen::Index size : sizes) {
    SCOPED_TRACE(size);
    const Eigen::MatrixXd a = random_matrix(size, size + 3, 11), lower = lower_of(random_matrix(size, size, 12));
    EXPECT_EQ(transposed(PaddedMatrix(a)).matrix(), a.transpose());
    EXPECT_EQ(PaddedMatrix::rows_reversed(a).matrix(), a.colwise().reverse());
    EXPECT_EQ(PaddedMatrix::reversed(a).matrix(), a.reverse());
    EXPECT_EQ(transposed_reversed(PaddedMatrix(lower)).matrix(), lower.transpose().reverse());
    PaddedMatrix symmetric(lower);
    mirror_lower(symmetric);
    EXPECT_EQ(symmetric.matrix(), Eigen::MatrixXd(lower.selfadjointView<Eigen::Lower>()));
  }
}

}  // namespace
}  // namespace sila::detail
