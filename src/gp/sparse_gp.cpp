#include "sila/gp/sparse_gp.hpp"

#include <cmath>
#include <cstring>

#include "core/concatenate.hpp"
#include "sila/core/fields.hpp"
#include "statistics.hpp"

namespace sila {
namespace {

/// The message is built only on failure: this runs for every posterior.
void require_shape(const char* whose, const char* name, Eigen::Index rows, Eigen::Index columns,
                   Eigen::Index wanted_rows, Eigen::Index wanted_columns) {
  if (rows == wanted_rows && columns == wanted_columns) return;
  throw invalid_argument(whose, ": ", name, " is ", rows, " x ", columns, ", must be ", wanted_rows, " x ",
                         wanted_columns);
}

void require_at_least_zero(const char* whose, const char* name, double value) {
  if (!(value >= 0.0) || !std::isfinite(value))
    throw invalid_argument(whose, ": ", name, " = ", value, ", must be finite and not negative");
}

/// Zero times a finite number is zero, times any other it is NaN: unlike `allFinite`, this uses vector registers.
void require_finite(const char* whose, const char* name, const auto& matrix) {
  if (!((matrix.array() * 0.0).sum() == 0.0))
    throw invalid_argument(whose, ": ", name, " holds a number that is not finite");
}

/// Compares number by number only if not all bits are equal.
bool same(const auto& a, const auto& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols()) return false;
  return a.size() == 0 || std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(double)) == 0 ||
         a == b;
}

}  // namespace

bool operator==(const SparseGp& a, const SparseGp& b) {
  return a.points == b.points && a.noise_variance == b.noise_variance && a.jitter == b.jitter && a.kernel == b.kernel &&
         same(a.mean, b.mean) && same(a.mean_response, b.mean_response) && same(a.pseudo_inputs, b.pseudo_inputs) &&
         same(a.response, b.response) && same(a.information, b.information);
}

SparseGp prior_gp(const Kernel& kernel, double noise_variance, const Eigen::MatrixXd& pseudo_inputs,
                  const Eigen::VectorXd& mean, double jitter) {
  SparseGp gp = detail::unchecked_prior(kernel, noise_variance, pseudo_inputs, mean, jitter);
  validate(gp);
  gp.jitter = detail::factor_kernel_matrix(covariance(kernel, pseudo_inputs, pseudo_inputs), kernel.signal_variance,
                                           jitter, "prior_gp")
                  .jitter;
  return gp;
}

SparseGp condition(const SparseGp& gp, const GpData& data) {
  validate(gp);
  validate("condition", data, gp.pseudo_inputs.rows(), gp.mean.size());
  SparseGp updated = gp;
  if (data.inputs.cols() > 0) detail::add_data(updated, data, detail::lower_factor(gp, "condition"));
  return updated;
}

void validate(const SparseGp& gp) {
  validate(gp.kernel);
  const Eigen::Index size = gp.pseudo_inputs.cols();
  detail::require_positive("sparse_gp", "noise_variance", gp.noise_variance);
  require_shape("sparse_gp", "pseudo_inputs", gp.pseudo_inputs.rows(), size, gp.kernel.length_scales.size(), size);
  require_shape("sparse_gp", "information", gp.information.rows(), gp.information.cols(), size, size);
  require_shape("sparse_gp", "response", gp.response.rows(), gp.response.cols(), size, gp.mean.size());
  require_shape("sparse_gp", "mean_response", gp.mean_response.rows(), 1, size, 1);
  require_finite("sparse_gp", "pseudo_inputs", gp.pseudo_inputs);
  require_finite("sparse_gp", "mean", gp.mean);
  require_finite("sparse_gp", "information", gp.information);
  require_finite("sparse_gp", "response", gp.response);
  require_finite("sparse_gp", "mean_response", gp.mean_response);
  if (size > 0 && !(gp.information.diagonal().minCoeff() >= -1e-9))
    throw invalid_argument("sparse_gp: information has a negative diagonal");
  require_at_least_zero("sparse_gp", "points", gp.points);
  require_at_least_zero("sparse_gp", "jitter", gp.jitter);
}

void validate(const char* function, const GpData& data, Eigen::Index input_dimensions, Eigen::Index output_dimensions) {
  const Eigen::Index points = data.inputs.cols();
  require_shape(function, "inputs", data.inputs.rows(), points, input_dimensions, points);
  require_shape(function, "outputs", data.outputs.rows(), data.outputs.cols(), points, output_dimensions);
  require_finite(function, "inputs", data.inputs);
  require_finite(function, "outputs", data.outputs);
}

void validate(const Hyperparameters& hyperparameters) {
  validate(hyperparameters.kernel);
  detail::require_positive("hyperparameters", "noise_variance", hyperparameters.noise_variance);
}

void validate(const GpConfig& config) {
  const Range share{0.0, 1.0}, positive{.min = 0.0, .open_min = true};
  require_in_range("gp", "max_pseudo_inputs", config.max_pseudo_inputs, {1, 1000});
  require_in_range("gp", "selection_stop", config.selection_stop, share);
  require_in_range("gp", "max_iterations", config.max_iterations, {1, 1e6});
  require_in_range("gp", "min_length_scale", config.min_length_scale, positive);
  require_in_range("gp", "min_noise_variance", config.min_noise_variance, positive);
  require_in_range("gp", "max_fused_pseudo_inputs", config.max_fused_pseudo_inputs, {1, 1000});
  require_in_range("gp", "keep_pseudo_inputs_share", config.keep_pseudo_inputs_share, share);
}

}  // namespace sila
