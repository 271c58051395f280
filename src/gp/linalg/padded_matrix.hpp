#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace sila::detail {

/// Columns are padded with zeros to a multiple of this, so that loops over vector registers need no tail: the widest
/// register holds 8 doubles.
inline constexpr std::size_t kColumnPadding = 8;
inline std::size_t padded(std::size_t size, std::size_t multiple) {
  return (size + multiple - 1) / multiple * multiple;
}

/// A column-major matrix, padded with zeros after its last row and column, so that whole panels and vector registers
/// are read and written; a factor is padded with an identity, so that it has an inverse.
class PaddedMatrix {
 public:
  static constexpr std::size_t kPanel = 4;  ///< columns that are processed together

  /// Zeros.
  PaddedMatrix(Eigen::Index rows, Eigen::Index columns);
  explicit PaddedMatrix(const Eigen::MatrixXd& matrix);
  /// Padded with an identity.
  static PaddedMatrix factor(const Eigen::MatrixXd& lower);
  /// Rows in reverse order.
  static PaddedMatrix rows_reversed(const Eigen::MatrixXd& matrix);
  /// Rows and columns in reverse order.
  static PaddedMatrix reversed(const Eigen::MatrixXd& matrix);

  using View = Eigen::Map<Eigen::MatrixXd, Eigen::Unaligned, Eigen::OuterStride<>>;
  using ConstView = Eigen::Map<const Eigen::MatrixXd, Eigen::Unaligned, Eigen::OuterStride<>>;
  /// Shapes: rows x columns.
  View matrix();
  ConstView matrix() const;

  void pad_with_identity();

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
/// A lower triangle's transpose, rows and columns in reverse order; a lower triangle again.
PaddedMatrix transposed_reversed(const PaddedMatrix& lower);
/// Copies the part below the diagonal to the part above.
void mirror_lower(PaddedMatrix& symmetric);

}  // namespace sila::detail
