#include <cmath>

#include "core/concatenate.hpp"
#include "posterior_simd.hpp"
#include "sila/gp/sparse_gp.hpp"
#include "statistics.hpp"

namespace sila {
namespace {

void require_dimension(const char* name, Eigen::Index rows, Eigen::Index dimension) {
  if (rows == dimension) return;
  throw invalid_argument("covariance: ", name, ".rows() = ", rows, ", must be the kernel's ", dimension,
                         " input dimensions");
}

}  // namespace

bool operator==(const Kernel& a, const Kernel& b) {
  return a.signal_variance == b.signal_variance && a.length_scales.size() == b.length_scales.size() &&
         (a.length_scales.array() == b.length_scales.array()).all();
}

Eigen::MatrixXd covariance(const Kernel& kernel, const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  validate(kernel);
  require_dimension("a", a.rows(), kernel.length_scales.size());
  require_dimension("b", b.rows(), kernel.length_scales.size());
  detail::CovarianceColumns columns(kernel, a);
  Eigen::MatrixXd result(a.cols(), b.cols());
  for (Eigen::Index j = 0; j < b.cols(); ++j) result.col(j) = columns.at(b.col(j).data()).head(a.cols());
  return result;
}

namespace detail {

void require_positive(const char* whose, const char* field, double value) {
  if (value > 0.0 && std::isfinite(value)) return;
  throw invalid_argument(whose, ": ", field, " = ", value, ", must be positive and finite");
}

CovarianceColumns::CovarianceColumns(const Kernel& kernel, const Eigen::MatrixXd& points)
    : points_(Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(padded(static_cast<std::size_t>(points.cols()))),
                                    points.rows())),
      column_(points_.rows()),
      inverse_(kernel.length_scales.cwiseInverse()),
      signal_variance_(kernel.signal_variance) {
  points_.topRows(points.cols()) = points.transpose();
}

const Eigen::VectorXd& CovarianceColumns::at(const double* point) {
  // The loops take differences before they scale, so that k(x, x) is exactly the signal variance.
  kernel_vector({static_cast<std::size_t>(inverse_.size()), static_cast<std::size_t>(points_.rows()), points_.data(),
                 inverse_.data(), signal_variance_},
                point, column_.data());
  return column_;
}

}  // namespace detail

void validate(const Kernel& kernel) {
  detail::require_positive("kernel", "signal_variance", kernel.signal_variance);
  if (kernel.length_scales.size() == 0) throw invalid_argument("kernel: length_scales.size() = 0, must be at least 1");
  for (const double length : kernel.length_scales) detail::require_positive("kernel", "length_scales", length);
}

}  // namespace sila
