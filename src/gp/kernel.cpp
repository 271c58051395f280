#include <cmath>
#include <stdexcept>

#include "core/concatenate.hpp"
#include "posterior_simd.hpp"
#include "sila/gp/sparse_gp.hpp"

namespace sila {
namespace {

void require_positive(const char* field, double value) {
  if (value > 0.0 && std::isfinite(value)) return;
  throw std::invalid_argument(concatenate("kernel: ", field, " = ", value, ", must be positive and finite"));
}

void require_dimension(const char* name, Eigen::Index rows, Eigen::Index dimension) {
  if (rows == dimension) return;
  throw std::invalid_argument(
      concatenate("covariance: ", name, ".rows() = ", rows, ", must be the kernel's ", dimension, " input dimensions"));
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
  // The loops take differences before they scale, so that k(x, x) is exactly the signal variance.
  const std::size_t rows = detail::padded(static_cast<std::size_t>(a.cols()));
  Eigen::MatrixXd points = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows), a.rows());
  points.topRows(a.cols()) = a.transpose();
  const Eigen::VectorXd inverse = kernel.length_scales.cwiseInverse();
  const detail::KernelView view{static_cast<std::size_t>(a.rows()), rows, points.data(), inverse.data(),
                                kernel.signal_variance};
  Eigen::VectorXd column(points.rows());
  Eigen::MatrixXd result(a.cols(), b.cols());
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    detail::kernel_vector(view, b.col(j).data(), column.data());
    result.col(j) = column.head(a.cols());
  }
  return result;
}

void validate(const Kernel& kernel) {
  require_positive("signal_variance", kernel.signal_variance);
  if (kernel.length_scales.size() == 0) {
    throw std::invalid_argument("kernel: length_scales.size() = 0, must be at least 1");
  }
  for (const double length : kernel.length_scales) require_positive("length_scales", length);
}

}  // namespace sila
