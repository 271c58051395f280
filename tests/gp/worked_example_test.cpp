#include <gtest/gtest.h>

#include <cmath>

#include "example.hpp"
#include "gp/fit.hpp"
#include "gp/fuse_gps.hpp"
#include "gp/posterior.hpp"

// The numbers were computed by an independent implementation and are given to ten digits.
namespace sila::gp_tests {
namespace {

void expect_near(const Eigen::MatrixXd& found, const Eigen::MatrixXd& wanted, double relative = 2e-9) {
  ASSERT_EQ(found.rows(), wanted.rows());
  ASSERT_EQ(found.cols(), wanted.cols());
  for (Eigen::Index i = 0; i < wanted.size(); ++i) {
    EXPECT_NEAR(found.reshaped()(i), wanted.reshaped()(i), relative * std::max(1.0, std::abs(wanted.reshaped()(i))));
  }
}

Eigen::MatrixXd symmetric(std::initializer_list<double> upper, Eigen::Index size) {
  Eigen::MatrixXd result(size, size);
  auto value = upper.begin();
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = i; j < size; ++j) result(i, j) = result(j, i) = *value++;
  }
  return result;
}

void expect_prediction(const SparseGp& gp, double x, double mean, double variance) {
  const GpPrediction prediction = predict(Posterior(gp), vector({x}));
  EXPECT_NEAR(prediction.mean(0), mean, 2e-10);
  EXPECT_NEAR(prediction.variance, variance, 2e-10);
}

TEST(WorkedExample, MarginalLikelihoodAndGradient) {
  const MarginalLikelihoodGradient gradient =
      negative_log_marginal_likelihood_gradient(example_data(), {unit_kernel(), 0.1}, row({0, 2}), 0.0);
  EXPECT_NEAR(gradient.value, 3.51730337, 1e-8);
  EXPECT_NEAR(gradient.log_signal_variance, 1.001843796, 1e-9);
  EXPECT_NEAR(gradient.log_length_scales(0), -1.581250676, 1e-9);
  EXPECT_NEAR(gradient.log_noise_variance, 0.3678181987, 1e-10);
  EXPECT_NEAR(gradient.pseudo_inputs(0, 0), -0.8414232575, 1e-10);
  EXPECT_NEAR(gradient.pseudo_inputs(0, 1), 1.078402428, 1e-9);
}

TEST(WorkedExample, StatisticsAndPredictions) {
  const SparseGp gp = condition(example_prior({0, 2}), example_data());
  expect_near(gp.information, symmetric({11.37587405, 3.03858191, 13.01063815}, 2));
  expect_near(gp.response, vector({10.4983282, -1.778573882}));
  EXPECT_EQ(gp.points, 4.0);
  EXPECT_EQ(gp.jitter, 0.0);
  expect_prediction(gp, 1.2, 0.2333031581, 0.3606688999);
  expect_prediction(gp, 3.0, -0.1902202032, 0.6548598863);
}

TEST(WorkedExample, StatisticsOfThePartsAddUp) {
  const SparseGp first = condition(example_prior({0, 2}), first_two());
  const SparseGp last = condition(example_prior({0, 2}), last_two());
  expect_near(first.information, symmetric({10.81399031, 0.7103641496, 0.6199302619}, 2));
  expect_near(first.response, vector({10.67102157, 0.5855962417}));
  expect_near(last.information, symmetric({0.561883746, 2.32821776, 12.39070788}, 2));
  expect_near(last.response, vector({-0.1726933724, -2.364170124}));
}

TEST(WorkedExample, TransferToMorePseudoInputsKeepsEverything) {
  const SparseGp stored = condition(example_prior({0, 2}), first_two());
  const SparseGp moved = transfer(stored, example_prior({0, 1, 2}));
  expect_near(moved.information,
              symmetric({10.81399031, 0.4729286652, 0.5300525471, 0.2747717265, 0.3079607226, 0.3451585354}, 3));
  expect_near(moved.response, vector({10.67102157, 0.3898637749, 0.4369544545}));
}

TEST(WorkedExample, TransferThenData) {
  const SparseGp stored = condition(example_prior({0, 2}), first_two());
  const SparseGp fitc = condition(transfer(stored, example_prior({0, 1, 2})), last_two());
  expect_prediction(fitc, 1.2, 0.3754449439, 0.1426863331);
  expect_prediction(fitc, 3.0, -0.2734895771, 0.6380516975);
}

TEST(WorkedExample, TwoStoredGpsOnOnePseudoInput) {
  const SparseGp first = condition(example_prior({0, 2}), first_two());
  const SparseGp last = condition(example_prior({0, 2}), last_two());
  const SparseGp prior = example_prior({1});
  expect_near(transfer(first, prior).information, row({0.8618912939}));
  expect_near(transfer(first, prior).response, row({0.9874328913}));
  expect_near(transfer(last, prior).information, row({0.6621162794}));
  expect_near(transfer(last, prior).response, row({0.02083546549}));
  const SparseGp both = transfer(last, transfer(first, prior));
  expect_prediction(both, 1.2, 0.3915611491, 0.4198708447);
  expect_prediction(both, 3.0, 0.05406254921, 0.9889409316);
}

}  // namespace
}  // namespace sila::gp_tests
