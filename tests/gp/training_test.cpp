#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "example.hpp"
#include "gp/fit.hpp"
#include "gp/fuse_gps.hpp"
#include "gp/posterior.hpp"

namespace sila::gp_tests {
namespace {

GpData centred(const GpData& data) {
  return {data.inputs, data.outputs.rowwise() - data.outputs.colwise().mean()};
}

double negative_log_marginal_likelihood(const GpData& data, const Hyperparameters& theta, const Eigen::MatrixXd& z,
                                        double jitter) {
  return negative_log_marginal_likelihood_gradient(data, theta, z, jitter).value;
}

TEST(MarginalLikelihood, GradientIsTheCentralDifference) {
  for_seeds(seeds, [](Generator& make, unsigned seed) {
    const Eigen::Index dimensions = 1 + seed % 3;
    const Hyperparameters theta = make.hyperparameters(dimensions);
    const GpData data = make.data(dimensions, 25, 1 + seed % 2);
    const Eigen::MatrixXd z = select_pseudo_inputs(theta.kernel, make.points(dimensions, 60), 7);
    const double jitter = seed % 2 == 0 ? 1e-6 : 0.0;
    const MarginalLikelihoodGradient gradient = negative_log_marginal_likelihood_gradient(data, theta, z, jitter);
    const double step = 1e-5;
    const auto slope = [&](const auto& value_at) { return (value_at(step) - value_at(-step)) / (2.0 * step); };
    const auto expect_slope = [&](double analytic, const auto& value_at) {
      EXPECT_NEAR(analytic, slope(value_at), 1e-6 * std::max(1.0, std::abs(analytic)));
    };
    expect_slope(gradient.log_signal_variance, [&](double by) {
      Hyperparameters moved = theta;
      moved.kernel.signal_variance *= std::exp(by);
      return negative_log_marginal_likelihood(data, moved, z, jitter);
    });
    expect_slope(gradient.log_noise_variance, [&](double by) {
      Hyperparameters moved = theta;
      moved.noise_variance *= std::exp(by);
      return negative_log_marginal_likelihood(data, moved, z, jitter);
    });
    for (Eigen::Index d = 0; d < dimensions; ++d) {
      expect_slope(gradient.log_length_scales(d), [&](double by) {
        Hyperparameters moved = theta;
        moved.kernel.length_scales(d) *= std::exp(by);
        return negative_log_marginal_likelihood(data, moved, z, jitter);
      });
      for (Eigen::Index m = 0; m < z.cols(); ++m) {
        expect_slope(gradient.pseudo_inputs(d, m), [&](double by) {
          Eigen::MatrixXd moved = z;
          moved(d, m) += by;
          return negative_log_marginal_likelihood(data, theta, moved, jitter);
        });
      }
    }
  });
}

TEST(MarginalLikelihood, OfTwoOutputsIsTheSumOfEach) {
  Generator make(5);
  const Hyperparameters theta = make.hyperparameters(2);
  const GpData data = make.data(2, 30, 2);
  const Eigen::MatrixXd z = select_pseudo_inputs(theta.kernel, data.inputs, 8);
  const MarginalLikelihoodGradient both = negative_log_marginal_likelihood_gradient(data, theta, z);
  const MarginalLikelihoodGradient first =
      negative_log_marginal_likelihood_gradient({data.inputs, data.outputs.col(0)}, theta, z);
  const MarginalLikelihoodGradient second =
      negative_log_marginal_likelihood_gradient({data.inputs, data.outputs.col(1)}, theta, z);
  EXPECT_NEAR(both.value, first.value + second.value, 1e-10);
  EXPECT_TRUE(both.pseudo_inputs.isApprox(first.pseudo_inputs + second.pseudo_inputs, 1e-9));
}

/// The points of the lattice on which pseudo-inputs stand that are nearest to these.
Eigen::MatrixXd on_lattice(const Eigen::MatrixXd& points, const Kernel& kernel) {
  const Eigen::ArrayXd step = GpConfig{}.lattice_step * kernel.length_scales.array();
  Eigen::MatrixXd rounded = points;
  for (Eigen::Index n = 0; n < points.cols(); ++n) rounded.col(n) = step * (points.col(n).array() / step).round() + 0.0;
  return rounded;
}

TEST(Fit, KeepsNoPointOfItsDataAsAPseudoInput) {
  for_seeds(seeds, [](Generator& make, unsigned seed) {
    GpConfig config;
    if (seed % 2 == 1) {
      config.pseudo_inputs = PseudoInputChoice::optimised;
      config.max_iterations = 3;
    }
    const Hyperparameters theta = make.hyperparameters(2);
    const GpData data = make.data(2, 2 + 7 * static_cast<int>(seed), 2);
    const SparseGp fitted = fit_sparse_gp(data, theta, config);
    const SparseGp fused = fuse_gps(std::array{&fitted}, make.data_at(2.0 * data.inputs, 2), config, theta);
    for (const SparseGp* gp : {&fitted, &fused}) {
      ASSERT_GT(gp->pseudo_inputs.cols(), 0);
      for (Eigen::Index m = 0; m < gp->pseudo_inputs.cols(); ++m) {
        for (Eigen::Index n = 0; n < data.inputs.cols(); ++n) {
          EXPECT_FALSE((gp->pseudo_inputs.col(m).array() == data.inputs.col(n).array()).any());
          EXPECT_FALSE((gp->pseudo_inputs.col(m).array() == 2.0 * data.inputs.col(n).array()).any());
        }
      }
    }
  });
}

TEST(Fit, WithFixedThetaIsTheGreedyPseudoInputsAndTheData) {
  Generator make(1);
  const Hyperparameters theta = make.hyperparameters(2);
  const GpData data = make.data(2, 90, 2);
  const SparseGp gp = fit_sparse_gp(data, theta);
  EXPECT_TRUE(gp.kernel == theta.kernel);
  EXPECT_EQ(gp.noise_variance, theta.noise_variance);
  EXPECT_EQ(gp.pseudo_inputs, select_pseudo_inputs(theta.kernel, on_lattice(data.inputs, theta.kernel), 30, 0.01));
  EXPECT_TRUE(gp.mean.isApprox(data.outputs.colwise().mean().transpose(), 1e-14));
  EXPECT_EQ(gp.points, 90.0);
  const Posterior posterior(gp);
  double error = 0.0;
  for (Eigen::Index n = 0; n < 90; ++n) {
    error += (predict(posterior, data.inputs.col(n)).mean - data.outputs.row(n).transpose()).squaredNorm() / 180.0;
  }
  EXPECT_LT(std::sqrt(error), 0.3);  // the noise of the data is 0.2
}

TEST(Fit, OfNoneOrOnePointIsTheConstantMeanWithThePriorsVariance) {
  const Hyperparameters theta{{0.64, vector({2, 2})}, 0.09};
  const SparseGp none = fit_sparse_gp({Eigen::MatrixXd(2, 0), Eigen::MatrixXd(0, 2)}, theta);
  EXPECT_EQ(Posterior(none).predict_flow({1, 1}).mean, Eigen::Vector2d(0, 0));
  EXPECT_EQ(none.points, 0.0);
  GpData one{Eigen::MatrixXd::Ones(2, 1), Eigen::MatrixXd(1, 2)};
  one.outputs << 0.3, 1.2;
  const SparseGp single = fit_sparse_gp(one, theta);
  EXPECT_EQ(Posterior(single).predict_flow({1, 1}).mean, Eigen::Vector2d(0.3, 1.2));
  EXPECT_EQ(Posterior(single).predict_flow({1, 1}).variance.x(), 0.64);
  EXPECT_EQ(single.points, 1.0);
}

TEST(Fit, OptimisationImprovesTheLikelihoodInsideTheBox) {
  for_seeds(4, [](Generator& make, unsigned) {
    const Hyperparameters start{{0.5, vector({1, 3})}, 0.3};
    const GpData data = make.data(2, 80, 2);
    const auto neg_log_likelihood = [&](const SparseGp& gp) {
      return negative_log_marginal_likelihood(centred(data), {gp.kernel, gp.noise_variance}, gp.pseudo_inputs,
                                              gp.jitter);
    };
    GpConfig config;
    config.max_pseudo_inputs = 10;
    const SparseGp fixed = fit_sparse_gp(data, start, config);
    config.pseudo_inputs = PseudoInputChoice::optimised;
    const SparseGp optimised = fit_sparse_gp(data, start, config);
    EXPECT_LT(neg_log_likelihood(optimised), neg_log_likelihood(fixed) - 2.0);
    EXPECT_GE(optimised.noise_variance, config.min_noise_variance * (1 - 1e-12));
    EXPECT_GE(optimised.kernel.length_scales.minCoeff(), config.min_length_scale * (1 - 1e-12));
  });
}

TEST(Fit, OptimisesAboutTheMeanThatItKeeps) {
  Generator make(6);
  GpData data = make.data(2, 80, 2);
  data.outputs.array() += 3.0;
  GpConfig config{.pseudo_inputs = PseudoInputChoice::optimised, .max_pseudo_inputs = 10};
  const auto about_zero = [&](ConstantMean mean) {
    config.constant_mean = mean;
    const SparseGp gp = fit_sparse_gp(data, {{0.5, vector({1, 3})}, 0.3}, config);
    return negative_log_marginal_likelihood(data, {gp.kernel, gp.noise_variance}, gp.pseudo_inputs, gp.jitter);
  };
  EXPECT_LT(about_zero(ConstantMean::zero), about_zero(ConstantMean::data) - 5.0);
}

TEST(Fit, RespectsTheNoiseFloorOnNoiselessData) {
  Generator make(7);
  const GpConfig config{.pseudo_inputs = PseudoInputChoice::optimised};
  const GpData data = make.data_at(make.points(2, 60), 2, 0.0);
  const SparseGp gp = fit_sparse_gp(data, {{1.0, vector({2, 2})}, 0.1}, config);
  EXPECT_GE(gp.noise_variance, config.min_noise_variance * (1 - 1e-12));
  EXPECT_GE(gp.noise_variance, config.min_noise_to_signal * gp.kernel.signal_variance * (1 - 1e-12));
  EXPECT_LT(gp.noise_variance, 0.02);
}

TEST(Fit, KeepsThetaWhenPointsAreFew) {
  Generator make(2);
  const GpConfig config{.pseudo_inputs = PseudoInputChoice::optimised};
  const Hyperparameters start = make.hyperparameters(2);
  const GpData data = make.data(2, 29, 2);
  const SparseGp gp = fit_sparse_gp(data, start, config);
  EXPECT_TRUE(gp.kernel == start.kernel);
  EXPECT_EQ(gp.pseudo_inputs, select_pseudo_inputs(start.kernel, on_lattice(data.inputs, start.kernel), 30, 0.01));
}

TEST(Fit, SurvivesDataOnALineAndCopies) {
  const GpConfig config{.pseudo_inputs = PseudoInputChoice::optimised};
  Generator make(4);
  Eigen::MatrixXd line = make.points(2, 50);
  line.row(1).setConstant(2.0);
  line.rightCols(20) = line.col(0).replicate(1, 20);
  GpData data = make.data_at(line, 2);
  data.outputs.col(1).setZero();
  for (const Eigen::Index count : {Eigen::Index{50}, Eigen::Index{2}}) {
    const SparseGp gp = fit_sparse_gp({data.inputs.rightCols(count), data.outputs.bottomRows(count)},
                                      {{1.0, vector({2, 2})}, 0.1}, config);
    EXPECT_NO_THROW(validate(gp));
    EXPECT_TRUE(Posterior(gp).predict_flow({0, 2}).mean.allFinite());
  }
}

TEST(Fit, FallsBackToZeroFarFromItsDataIfAsked) {
  const GpData one{Eigen::MatrixXd::Zero(2, 1), Eigen::MatrixXd::Constant(1, 2, 3.0)};
  const Hyperparameters theta{{1.0, Eigen::VectorXd::Ones(2)}, 0.1};
  const Posterior posterior(fit_sparse_gp(one, theta, {.constant_mean = ConstantMean::zero}));
  EXPECT_NEAR(predict(posterior, Eigen::VectorXd::Zero(2)).mean(0), 3.0 / 1.1, 1e-4);  // shrunk by the noise
  EXPECT_NEAR(predict(posterior, Eigen::VectorXd::Constant(2, 50.0)).mean(0), 0.0, 1e-12);
  EXPECT_NEAR(predict(Posterior(fit_sparse_gp(one, theta)), Eigen::VectorXd::Constant(2, 50.0)).mean(0), 3.0, 1e-12);
}

}  // namespace
}  // namespace sila::gp_tests
