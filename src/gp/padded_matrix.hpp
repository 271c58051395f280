#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace sila::detail {

/// A matrix, column by column. Behind its last row and column stand zeros, so that whole panels and vector registers
/// are read and written; behind a factor an identity, so that it has an inverse.
class PaddedMatrix {
 public:
  static constexpr std::size_t kPanel = 4;  ///< columns that are worked on together

  /// Zeros.
  PaddedMatrix(Eigen::Index rows, Eigen::Index columns);
  explicit PaddedMatrix(const Eigen::MatrixXd& matrix);
  /// With an identity behind.
  static PaddedMatrix factor(const Eigen::MatrixXd& lower);
  /// The last row first.
  static PaddedMatrix rows_reversed(const Eigen::MatrixXd& matrix);
  /// The last row and column first.
  static PaddedMatrix reversed(const Eigen::MatrixXd& matrix);

  using View = Eigen::Map<Eigen::MatrixXd, Eigen::Unaligned, Eigen::OuterStride<>>;
  using ConstView = Eigen::Map<const Eigen::MatrixXd, Eigen::Unaligned, Eigen::OuterStride<>>;
  /// Shapes: rows x columns.
  View matrix();
  ConstView matrix() const;

  void set_identity_behind();

  Eigen::Index rows() const { return rows_; }
  Eigen::Index columns() const { return columns_; }
  std::size_t padded_rows() const { return padded_rows_; }
  std::size_t padded_columns() const { return padded_columns_; }
  std::size_t stride() const { return stride_; }  ///< from one column to the next
  double* column(std::size_t j) { return numbers_.data() + j * stride_; }
  const double* column(std::size_t j) const { return numbers_.data() + j * stride_; }

 private:
  Eigen::Index rows_, columns_;
  std::size_t padded_rows_, padded_columns_, stride_;
  std::vector<double> numbers_;
};

PaddedMatrix transposed(const PaddedMatrix& a);
/// A lower triangle's transpose, the last row and column first; a lower triangle again.
PaddedMatrix transposed_reversed(const PaddedMatrix& lower);
/// What is above the diagonal becomes what is below.
void mirror_lower(PaddedMatrix& symmetric);

}  // namespace sila::detail
