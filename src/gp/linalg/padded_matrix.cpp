#include "padded_matrix.hpp"

#include <algorithm>

namespace sila::detail {

PaddedMatrix::PaddedMatrix(Eigen::Index rows, Eigen::Index columns)
    : rows_(rows),
      columns_(columns),
      padded_rows_(padded(static_cast<std::size_t>(rows), kPanel)),
      padded_columns_(padded(static_cast<std::size_t>(columns), kPanel)),
      stride_(padded(static_cast<std::size_t>(rows), kColumnPadding)),
      numbers_(padded_columns_ * stride_) {}

PaddedMatrix::PaddedMatrix(const Eigen::MatrixXd& matrix) : PaddedMatrix(matrix.rows(), matrix.cols()) {
  for (Eigen::Index j = 0; j < columns_; ++j)
    std::copy_n(matrix.col(j).data(), rows_, column(static_cast<std::size_t>(j)));
}

PaddedMatrix PaddedMatrix::factor(const Eigen::MatrixXd& lower) {
  PaddedMatrix result(lower);
  result.pad_with_identity();
  return result;
}

void PaddedMatrix::pad_with_identity() {
  for (auto i = static_cast<std::size_t>(rows_); i < padded_rows_; ++i) column(i)[i] = 1.0;
}

PaddedMatrix PaddedMatrix::rows_reversed(const Eigen::MatrixXd& matrix) {
  PaddedMatrix result(matrix.rows(), matrix.cols());
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    const double* const column = matrix.col(j).data();
    std::reverse_copy(column, column + matrix.rows(), result.column(static_cast<std::size_t>(j)));
  }
  return result;
}

PaddedMatrix PaddedMatrix::reversed(const Eigen::MatrixXd& matrix) {
  PaddedMatrix result(matrix.rows(), matrix.cols());
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    const double* const column = matrix.col(matrix.cols() - 1 - j).data();
    std::reverse_copy(column, column + matrix.rows(), result.column(static_cast<std::size_t>(j)));
  }
  return result;
}

PaddedMatrix::View PaddedMatrix::matrix() {
  return {numbers_.data(), rows_, columns_, Eigen::OuterStride<>(static_cast<Eigen::Index>(stride_))};
}

PaddedMatrix::ConstView PaddedMatrix::matrix() const {
  return {numbers_.data(), rows_, columns_, Eigen::OuterStride<>(static_cast<Eigen::Index>(stride_))};
}

PaddedMatrix transposed(const PaddedMatrix& a) {
  PaddedMatrix result(a.columns(), a.rows());
  for (std::size_t j = 0; j < result.padded_columns(); ++j) {
    for (std::size_t i = 0; i < result.padded_rows(); ++i) result.column(j)[i] = a.column(i)[j];
  }
  return result;
}

PaddedMatrix transposed_reversed(const PaddedMatrix& lower) {
  PaddedMatrix result(lower.rows(), lower.rows());
  const auto size = static_cast<std::size_t>(lower.rows());
  for (std::size_t j = 0; j < size; ++j) {
    for (std::size_t i = j; i < size; ++i) result.column(j)[i] = lower.column(size - 1 - i)[size - 1 - j];
  }
  return result;
}

void mirror_lower(PaddedMatrix& symmetric) {
  for (std::size_t j = 1; j < symmetric.padded_columns(); ++j) {
    for (std::size_t i = 0; i < j; ++i) symmetric.column(j)[i] = symmetric.column(i)[j];
  }
}

}  // namespace sila::detail
