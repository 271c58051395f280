#include "sila/gp/kernel.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace sila {
namespace {

void require_positive(const std::string& field, double value) {
  if (value > 0.0 && std::isfinite(value)) return;
  throw std::invalid_argument("kernel: " + field + " = " + std::to_string(value) + ", must be positive and finite");
}

void require_dimension(const char* name, Eigen::Index rows, Eigen::Index dimension) {
  if (rows == dimension) return;
  throw std::invalid_argument(std::string("covariance: ") + name + ".rows() = " + std::to_string(rows) +
                              ", must be the kernel's " + std::to_string(dimension) + " input dimensions");
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
  // Differences before scaling, so that k(x, x) is exactly the signal variance; one long column per point of b
  // vectorises.
  const Eigen::MatrixXd points = a.transpose();
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(a.cols(), b.cols());
  for (Eigen::Index d = 0; d < a.rows(); ++d) {
    const double inverse = 1.0 / kernel.length_scales(d);
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
      result.col(j).array() += ((points.col(d).array() - b(d, j)) * inverse).square();
    }
  }
  result.array() = kernel.signal_variance * (-0.5 * result.array()).exp();
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
