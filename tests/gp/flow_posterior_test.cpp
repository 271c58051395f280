#include "gp/flow_posterior.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "example.hpp"
#include "gp/fit.hpp"

namespace sila::gp_tests {
namespace {

GpData component(const GpData& data, Eigen::Index which) {
  return {data.inputs, data.outputs.col(which)};
}

TEST(FlowPosterior, IndependentOutputsEqualSharedOnesUnderOneTheta) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Generator random(seed);
    const GpData data = random.data(2, 60, 2);
    const Hyperparameters theta = random.hyperparameters(2);
    const FlowPosterior shared(fit_sparse_gp(data, theta));
    const SparseGp x = fit_sparse_gp(component(data, 0), theta), y = fit_sparse_gp(component(data, 1), theta);
    const FlowPosterior independent(x, &y);
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector2d place = random.points(2, 1);
      const FieldLinearisation a = shared.linearise(place), b = independent.linearise(place);
      EXPECT_LT((a.flow.mean - b.flow.mean).norm(), 1e-9);
      EXPECT_LT((a.flow.variance - b.flow.variance).norm(), 1e-9);
      EXPECT_LT((a.jacobian - b.jacobian).norm(), 1e-9);
      EXPECT_EQ(independent.predict(place).mean, b.flow.mean);
      EXPECT_NEAR(shared.unexplained_share(a.flow), independent.unexplained_share(b.flow), 1e-9);
    }
    const std::vector<double> xs{0.0, 1.0}, ys{0.5};
    const std::vector<RasterIndex> places{{0, 0}, {1, 0}};
    const std::vector<FieldPrediction> first = shared.bounds(xs, ys, places),
                                       second = independent.bounds(xs, ys, places);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_LT((first[i].mean - second[i].mean).norm(), 1e-9);
      EXPECT_LT((first[i].variance - second[i].variance).norm(), 1e-9);
    }
  }
}

TEST(FlowPosterior, LeavesUnexplainedWhatTheLessKnownComponentDoes) {
  Generator random(3);
  const Hyperparameters theta{{1.0, Eigen::VectorXd::Constant(2, 1.0)}, 0.05};
  const GpData data = random.data_at(random.points(2, 80, 4.0), 2);
  const SparseGp x = fit_sparse_gp(component(data, 0), theta);
  const SparseGp nothing = prior_gp(theta.kernel, theta.noise_variance, x.pseudo_inputs, Eigen::VectorXd::Zero(1));
  const Eigen::Vector2d place = data.inputs.col(0);
  EXPECT_LT(FlowPosterior(x, &x).unexplained_share(FlowPosterior(x, &x).predict(place)), 0.5);
  EXPECT_NEAR(FlowPosterior(x, &nothing).unexplained_share(FlowPosterior(x, &nothing).predict(place)), 1.0, 1e-9);
}

TEST(FlowPosterior, RejectsGpsWithAnotherNumberOfOutputs) {
  Generator random(4);
  const GpData data = random.data(2, 20, 2);
  const SparseGp both = fit_sparse_gp(data, random.hyperparameters(2));
  const SparseGp one = fit_sparse_gp(component(data, 0), random.hyperparameters(2));
  EXPECT_THROW(FlowPosterior{one}, std::invalid_argument);
  EXPECT_THROW(FlowPosterior(both, &one), std::invalid_argument);
  EXPECT_THROW(FlowPosterior(one, &both), std::invalid_argument);
}

}  // namespace
}  // namespace sila::gp_tests
