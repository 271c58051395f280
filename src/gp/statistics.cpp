#include "statistics.hpp"

#include <Eigen/Cholesky>

#include "core/concatenate.hpp"
#include "sila/core/errors.hpp"

namespace sila::detail {
namespace {

constexpr double max_jitter = 1e-2;
constexpr double smallest_pivot = 1e-13;  // relative to the signal variance; below it the factor is rounding noise

}  // namespace

bool cholesky_in_place(Eigen::MatrixXd& a) {
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(a);
  // A NaN passes Eigen's test; one off the diagonal reaches the diagonal of the same row.
  return cholesky.info() == Eigen::Success && a.diagonal().allFinite();
}

KernelFactor factor_kernel_matrix(const Eigen::MatrixXd& kernel_matrix, double signal_variance, double jitter,
                                  const char* function) {
  for (double trial = jitter; trial <= max_jitter * (1.0 + 1e-9); trial = trial > 0.0 ? trial * 10.0 : 1e-10) {
    Eigen::MatrixXd lower = kernel_matrix;
    lower.diagonal().array() += trial * signal_variance;
    if (!cholesky_in_place(lower)) continue;
    if ((lower.diagonal().array().square() >= smallest_pivot * signal_variance).all()) return {std::move(lower), trial};
  }
  throw NumericalError(concatenate(function, ": the covariance of ", kernel_matrix.rows(),
                                   " pseudo-inputs (signal variance ", signal_variance,
                                   ") has no Cholesky factor, even with a jitter of ", max_jitter));
}

Eigen::MatrixXd lower_factor(const SparseGp& gp, const char* function) {
  KernelFactor factor = factor_kernel_matrix(covariance(gp.kernel, gp.pseudo_inputs, gp.pseudo_inputs),
                                             gp.kernel.signal_variance, gp.jitter, function);
  if (factor.jitter == gp.jitter) return std::move(factor.lower);
  throw NumericalError(concatenate(function, ": jitter = ", gp.jitter, " is too small for the covariance of ",
                                   gp.pseudo_inputs.cols(), " pseudo-inputs, ", factor.jitter, " is sufficient"));
}

SparseGp unchecked_prior(const Kernel& kernel, double noise_variance, const Eigen::MatrixXd& pseudo_inputs,
                         const Eigen::VectorXd& mean, double jitter) {
  const Eigen::Index size = pseudo_inputs.cols();
  return {.kernel = kernel,
          .noise_variance = noise_variance,
          .pseudo_inputs = pseudo_inputs,
          .mean = mean,
          .information = Eigen::MatrixXd::Zero(size, size),
          .response = Eigen::MatrixXd::Zero(size, mean.size()),
          .mean_response = Eigen::VectorXd::Zero(size),
          .jitter = jitter};
}

Eigen::MatrixXd whitened(const Eigen::MatrixXd& lower, Eigen::MatrixXd cross) {
  lower.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(cross);
  return cross;
}

Statistics statistics_of(const SparseGp& gp, const Eigen::MatrixXd& lower, const GpData& data, double noise_variance) {
  Eigen::MatrixXd features = whitened(lower, covariance(gp.kernel, data.inputs, gp.pseudo_inputs));
  const Eigen::MatrixXd residuals = data.outputs.rowwise() - gp.mean.transpose();
  // The unexplained variance is negative only by rounding.
  const Eigen::ArrayXd unexplained = (gp.kernel.signal_variance - features.rowwise().squaredNorm().array()).max(0.0);
  const Eigen::VectorXd scale = (noise_variance + unexplained).rsqrt();
  features.array().colwise() *= scale.array();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(features.cols(), features.cols());
  information.selfadjointView<Eigen::Lower>().rankUpdate(features.transpose());
  information.triangularView<Eigen::StrictlyUpper>() = information.transpose();
  return {std::move(information), features.transpose() * (scale.asDiagonal() * residuals),
          features.transpose() * scale};
}

void add(SparseGp& gp, const Statistics& statistics, double points) {
  gp.information += statistics.information;
  gp.response += statistics.response;
  gp.mean_response += statistics.mean_response;
  gp.points += points;
}

void add_data(SparseGp& gp, const GpData& data, const Eigen::MatrixXd& lower) {
  add(gp, statistics_of(gp, lower, data, gp.noise_variance), static_cast<double>(data.inputs.cols()));
}

}  // namespace sila::detail
