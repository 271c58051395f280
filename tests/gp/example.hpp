#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <initializer_list>
#include <random>
#include <span>
#include <string>

#include "gp/posterior.hpp"
#include "gp/statistics.hpp"
#include "sila/gp/sparse_gp.hpp"

namespace sila::gp_tests {

inline Eigen::MatrixXd row(std::initializer_list<double> values) {
  Eigen::MatrixXd result(1, static_cast<Eigen::Index>(values.size()));
  Eigen::Index i = 0;
  for (const double value : values) result(0, i++) = value;
  return result;
}

inline Eigen::VectorXd vector(std::initializer_list<double> values) {
  return row(values).transpose();
}

/// The worked example: one input, one output, no jitter.
inline Kernel unit_kernel() {
  return {1.0, Eigen::VectorXd::Ones(1)};
}
inline GpData example_data() {
  return {row({0, 1, 1.5, 2}), row({1, 0.5, 0.2, -0.3}).transpose()};
}
inline GpData first_two() {
  return {row({0, 1}), row({1, 0.5}).transpose()};
}
inline GpData last_two() {
  return {row({1.5, 2}), row({0.2, -0.3}).transpose()};
}
inline SparseGp example_prior(std::initializer_list<double> pseudo_inputs) {
  return prior_gp(unit_kernel(), 0.1, row(pseudo_inputs), vector({0}), 0.0);
}
inline Eigen::MatrixXd select_pseudo_inputs(const Kernel& kernel, const Eigen::MatrixXd& candidates, int max_count,
                                            double stop_fraction = 0.01) {
  return candidates(Eigen::all,
                    detail::select_greedily(kernel, candidates, max_count, stop_fraction, default_jitter).chosen);
}
inline GpData joined(const GpData& a, const GpData& b) {
  GpData both{Eigen::MatrixXd(a.inputs.rows(), a.inputs.cols() + b.inputs.cols()),
              Eigen::MatrixXd(a.outputs.rows() + b.outputs.rows(), a.outputs.cols())};
  both.inputs << a.inputs, b.inputs;
  both.outputs << a.outputs, b.outputs;
  return both;
}

/// Mean and variance of the latent function at one point.
struct GpPrediction {
  Eigen::VectorXd mean;
  double variance = 0.0;
};
inline GpPrediction predict(const Posterior& posterior, const Eigen::VectorXd& x) {
  GpPrediction prediction{Eigen::VectorXd(static_cast<Eigen::Index>(posterior.outputs()))};
  prediction.variance = posterior
                            .predict(std::span(x.data(), static_cast<std::size_t>(x.size())),
                                     std::span(prediction.mean.data(), posterior.outputs()))
                            .value();
  return prediction;
}

/// Numbers for laws; the seed is printed by the test.
class Generator {
 public:
  explicit Generator(unsigned seed) : engine_(seed) {}

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  double normal() { return std::normal_distribution<double>()(engine_); }

  Eigen::MatrixXd points(Eigen::Index dimensions, Eigen::Index count, double side = 6.0) {
    return Eigen::MatrixXd::NullaryExpr(dimensions, count, [&] { return uniform(-0.5 * side, 0.5 * side); });
  }
  /// A smooth flow and noise at these points.
  GpData data_at(const Eigen::MatrixXd& inputs, Eigen::Index outputs, double noise = 0.2) {
    GpData data{inputs, Eigen::MatrixXd(inputs.cols(), outputs)};
    for (Eigen::Index n = 0; n < inputs.cols(); ++n) {
      for (Eigen::Index p = 0; p < outputs; ++p) {
        data.outputs(n, p) =
            0.7 + std::sin(0.6 * inputs.col(n).sum() + 1.3 * static_cast<double>(p)) + noise * normal();
      }
    }
    return data;
  }
  GpData data(Eigen::Index dimensions, Eigen::Index count, Eigen::Index outputs) {
    return data_at(points(dimensions, count), outputs);
  }
  Hyperparameters hyperparameters(Eigen::Index dimensions) {
    Hyperparameters theta;
    theta.kernel.signal_variance = uniform(0.3, 2.0);
    theta.kernel.length_scales =
        Eigen::VectorXd::NullaryExpr(dimensions, [&](Eigen::Index) { return uniform(0.8, 2.5); });
    theta.noise_variance = uniform(0.02, 0.3);
    return theta;
  }

 private:
  std::mt19937 engine_;
};

/// How many seeds the laws are tried with.
inline constexpr unsigned seeds = 12;

/// Runs a law with generators of the seeds 0 .. count - 1 and names the seed that breaks it.
template <class Law>
void for_seeds(unsigned count, Law law) {
  for (unsigned seed = 0; seed < count; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Generator make(seed);
    law(make, seed);
  }
}

}  // namespace sila::gp_tests
