#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <limits>

#include "example.hpp"
#include "gp/fit.hpp"
#include "gp/fuse_gps.hpp"
#include "gp/posterior.hpp"
#include "support/message_of.hpp"

namespace sila::gp_tests {
namespace {

SparseGp prior_on(const Hyperparameters& theta, const Eigen::MatrixXd& pseudo_inputs, const Eigen::VectorXd& mean) {
  return prior_gp(theta.kernel, theta.noise_variance, pseudo_inputs, mean);
}

/// The formulas of the textbook, without any rearrangement.
GpPrediction textbook(const SparseGp& gp, const Eigen::VectorXd& x) {
  const Eigen::Index size = gp.pseudo_inputs.cols();
  Eigen::MatrixXd own = covariance(gp.kernel, gp.pseudo_inputs, gp.pseudo_inputs);
  own.diagonal().array() += gp.jitter * gp.kernel.signal_variance;
  const Eigen::MatrixXd lower = own.llt().matrixL();
  const Eigen::VectorXd k =
      lower.triangularView<Eigen::Lower>().solve(covariance(gp.kernel, gp.pseudo_inputs, Eigen::MatrixXd(x)));
  const Eigen::LLT<Eigen::MatrixXd> seen(Eigen::MatrixXd::Identity(size, size) + gp.information);
  const Eigen::VectorXd reduced = seen.matrixL().solve(k);
  return {gp.mean + seen.solve(gp.response).transpose() * k,
          gp.kernel.signal_variance - k.squaredNorm() + reduced.squaredNorm()};
}

TEST(SparseGp, OnePseudoInputPerPointIsTheFullGp) {
  for_seeds(seeds, [](Generator& make, unsigned) {
    const Hyperparameters theta = make.hyperparameters(2);
    const Eigen::MatrixXd spread = select_pseudo_inputs(theta.kernel, make.points(2, 80), 20, 0.02);
    const GpData data = make.data_at(spread, 2);
    const SparseGp gp = condition(prior_gp(theta.kernel, theta.noise_variance, spread, vector({0.3, -0.2}), 0.0), data);
    Eigen::MatrixXd full = covariance(theta.kernel, spread, spread);
    full.diagonal().array() += theta.noise_variance;
    const Eigen::LLT<Eigen::MatrixXd> cholesky(full);
    const Eigen::MatrixXd residuals = data.outputs.rowwise() - gp.mean.transpose();
    for (int i = 0; i < 20; ++i) {
      const Eigen::VectorXd x = make.points(2, 1, 9.0);
      const Eigen::VectorXd k = covariance(theta.kernel, spread, Eigen::MatrixXd(x));
      const GpPrediction prediction = predict(Posterior(gp), x);
      const Eigen::VectorXd mean = gp.mean + cholesky.solve(residuals).transpose() * k;
      EXPECT_NEAR((prediction.mean - mean).norm(), 0.0, 1e-9);
      EXPECT_NEAR(prediction.variance, theta.kernel.signal_variance - k.dot(cholesky.solve(k)), 1e-9);
    }
  });
}

TEST(SparseGp, ConditioningInAnyOrderIsOneFit) {
  for_seeds(seeds, [](Generator& make, unsigned) {
    const Hyperparameters theta = make.hyperparameters(2);
    const GpData data = make.data(2, 60, 2);
    const SparseGp prior = prior_on(theta, select_pseudo_inputs(theta.kernel, data.inputs, 15), vector({0.5, 0.1}));
    const SparseGp once = condition(prior, data);
    SparseGp pieces = prior;
    for (const Eigen::Index begin : {40, 0, 20}) {
      pieces = condition(pieces, {data.inputs.middleCols(begin, 20), data.outputs.middleRows(begin, 20)});
    }
    EXPECT_TRUE(pieces.information.isApprox(once.information, 1e-12));
    EXPECT_TRUE(pieces.response.isApprox(once.response, 1e-12));
    EXPECT_TRUE(pieces.mean_response.isApprox(once.mean_response, 1e-12));
    EXPECT_EQ(pieces.points, once.points);
  });
}

TEST(SparseGp, TheConstantMeanCanBeChangedLater) {
  for_seeds(seeds, [](Generator& make, unsigned) {
    const Hyperparameters theta = make.hyperparameters(2);
    const GpData data = make.data(2, 40, 2);
    const Eigen::MatrixXd pseudo_inputs = select_pseudo_inputs(theta.kernel, data.inputs, 15);
    const SparseGp before = condition(prior_on(theta, pseudo_inputs, vector({0.4, -0.6})), data);
    const SparseGp prior = prior_on(theta, pseudo_inputs, vector({-1.0, 2.0}));
    const SparseGp changed = transfer(before, prior);
    EXPECT_TRUE(changed.response.isApprox(condition(prior, data).response, 1e-11));
    EXPECT_EQ(changed.information, before.information);
  });
}

TEST(Posterior, MatchesTheTextbook) {
  for_seeds(seeds, [](Generator& make, unsigned) {
    const Hyperparameters theta = make.hyperparameters(2);
    const SparseGp gp = fit_sparse_gp(make.data(2, 120, 2), theta);
    const Posterior posterior(gp);
    for (int i = 0; i < 40; ++i) {
      const Eigen::Vector2d x = make.points(2, 1, 12.0);
      const GpPrediction wanted = textbook(gp, x);
      const GpPrediction general = predict(posterior, x);
      const FieldPrediction flow = posterior.predict_flow(x);
      EXPECT_NEAR((general.mean - wanted.mean).norm(), 0.0, 1e-8);
      EXPECT_NEAR((flow.mean - wanted.mean).norm(), 0.0, 1e-8);
      EXPECT_NEAR(general.variance, std::max(0.0, wanted.variance), 1e-8);
      EXPECT_NEAR(flow.variance.x(), std::max(0.0, wanted.variance), 1e-8);
      const FieldLinearisation both = posterior.linearise_flow(x);
      EXPECT_EQ(both.flow.mean, flow.mean);
      EXPECT_EQ(both.flow.variance, flow.variance);
    }
  });
}

/// Of these tables half is left out: with as much, less and more seen than there are pseudo-inputs.
TEST(Posterior, MatchesTheTextbookWithManyPseudoInputs) {
  const GpConfig config{.max_pseudo_inputs = 90, .selection_stop = 0.0};
  for (const Eigen::Index seen : {50, 70, 90, 400}) {
    SCOPED_TRACE("points " + std::to_string(seen));
    Generator make(static_cast<unsigned>(seen));
    const Hyperparameters theta{{1.3, vector({0.6, 0.9})}, 0.05};
    const GpData data = make.data(2, 400, 2);
    const SparseGp known = fit_sparse_gp(data, theta, config);
    ASSERT_EQ(known.pseudo_inputs.cols(), 90);
    const SparseGp gp = condition(prior_on(theta, known.pseudo_inputs, known.mean),
                                  {data.inputs.leftCols(seen), data.outputs.topRows(seen)});
    const Posterior posterior(gp);
    for (int i = 0; i < 40; ++i) {
      const Eigen::Vector2d x = make.points(2, 1, 9.0);
      const GpPrediction wanted = textbook(gp, x), found = predict(posterior, x);
      EXPECT_NEAR((found.mean - wanted.mean).norm(), 0.0, 1e-8);
      EXPECT_NEAR(found.variance, std::max(0.0, wanted.variance), 1e-8);
    }
  }
}

TEST(Posterior, StaysValidWithAHundredMillionTimesThePoints) {
  Generator make(4);
  const Hyperparameters theta{{1.0, vector({1.0, 1.0})}, 0.01};
  const GpData data = make.data(2, 20, 2);
  SparseGp gp = condition(prior_on(theta, make.points(2, 60), vector({0.0, 0.0})), data);
  const Posterior once(gp);
  gp.information *= 1e8;
  gp.response *= 1e8;
  const Posterior often(gp);
  for (Eigen::Index i = 0; i < data.inputs.cols(); ++i) {
    const Eigen::VectorXd x = data.inputs.col(i);
    EXPECT_LT(predict(often, x).variance, predict(once, x).variance);
  }
  EXPECT_NEAR(predict(often, vector({100.0, 100.0})).variance, 1.0, 1e-9);
}

TEST(Posterior, MatchesTheTextbookWithMorePseudoInputsThanTheStackHolds) {
  Generator make(3);
  const Hyperparameters theta{{1.0, vector({0.4, 0.4})}, 0.1};
  const GpConfig config{.max_pseudo_inputs = 300, .selection_stop = 0.0};
  const SparseGp gp = fit_sparse_gp(make.data(2, 400, 2), theta, config);
  ASSERT_GT(gp.pseudo_inputs.cols(), static_cast<Eigen::Index>(Posterior::max_stack_pseudo_inputs));
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector2d x = make.points(2, 1, 8.0);
    const GpPrediction wanted = textbook(gp, x);
    const FieldPrediction flow = Posterior(gp).predict_flow(x);
    EXPECT_NEAR((flow.mean - wanted.mean).norm(), 0.0, 1e-8);
    EXPECT_NEAR(flow.variance.x(), wanted.variance, 1e-8);
  }
}

TEST(Posterior, JacobianIsTheCentralDifferenceOfTheMean) {
  for_seeds(seeds, [](Generator& make, unsigned) {
    const Posterior posterior(fit_sparse_gp(make.data(2, 80, 2), make.hyperparameters(2)));
    const Eigen::Vector2d x = make.points(2, 1);
    const Eigen::Matrix2d jacobian = posterior.linearise_flow(x).jacobian;
    const double step = 1e-5;
    for (Eigen::Index d = 0; d < 2; ++d) {
      const Eigen::Vector2d shift = step * Eigen::Vector2d::Unit(d);
      const Eigen::Vector2d slope =
          (posterior.predict_flow(x + shift).mean - posterior.predict_flow(x - shift).mean) / (2.0 * step);
      EXPECT_NEAR((jacobian.col(d) - slope).norm(), 0.0, 1e-7);
    }
  });
}

TEST(Posterior, VarianceStaysBetweenZeroAndThePrior) {
  for_seeds(seeds, [](Generator& make, unsigned seed) {
    Hyperparameters theta = make.hyperparameters(2);
    if (seed % 2 == 1) theta.noise_variance = 1e-8;  // nothing left to be unsure of at the data
    const GpData data = make.data(2, 150, 2);
    const Posterior posterior(fit_sparse_gp(data, theta));
    for (Eigen::Index i = 0; i < 300; ++i) {
      const Eigen::Vector2d x =
          i < 150 ? Eigen::Vector2d(data.inputs.col(i)) : Eigen::Vector2d(make.points(2, 1, 40.0));
      for (const double variance : {predict(posterior, x).variance, posterior.predict_flow(x).variance.x()}) {
        EXPECT_GE(variance, 0.0);
        EXPECT_LE(variance, theta.kernel.signal_variance);
      }
    }
  });
}

TEST(Posterior, IsEmptyOnlyBelowTheLeastShare) {
  int known = 0, unknown = 0;
  for_seeds(seeds, [&](Generator& make, unsigned) {
    const Hyperparameters theta = make.hyperparameters(2);
    const Posterior posterior(fit_sparse_gp(make.data(2, 80, 2), theta));
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector2d x = make.points(2, 1, 40.0);
      const FieldPrediction flow = posterior.predict_flow(x);
      for (const double share : {1e-6, 0.5}) {
        Eigen::Vector2d mean;
        const auto answer = posterior.predict(std::span(x.data(), 2), std::span(mean.data(), 2), share);
        if (answer) {
          EXPECT_EQ(mean, flow.mean);
          EXPECT_EQ(Eigen::Vector2d::Constant(*answer), flow.variance);
        } else {
          EXPECT_GT(flow.variance.x(), (1.0 - share) * theta.kernel.signal_variance);
        }
        ++(answer ? known : unknown);
      }
      const std::array<double, 3> xs{x.x() - 1.0, x.x(), x.x() + 1.0};
      const std::array<double, 2> ys{x.y(), x.y() + 2.0};
      const std::array<RasterIndex, 2> places{RasterIndex{2, 1}, RasterIndex{1, 0}};
      const std::vector<FieldPrediction> bounds = posterior.bound_flows(xs, ys, places);
      EXPECT_TRUE(bounds[0].mean.isApprox(posterior.predict_flow({xs[2], ys[1]}).mean, 1e-12));
      EXPECT_TRUE(bounds[1].mean.isApprox(flow.mean, 1e-12));
      EXPECT_LE(bounds[1].variance.x(), flow.variance.x() + 1e-9 * theta.kernel.signal_variance);
      EXPECT_THROW(posterior.bound_flows(std::span(xs).first(2), ys, places), std::invalid_argument);
    }
  });
  EXPECT_GT(known, 100);
  EXPECT_GT(unknown, 100);
}

TEST(Posterior, WithoutPseudoInputsIsTheConstantMean) {
  const SparseGp gp = prior_gp({2.5, vector({1, 1})}, 0.1, Eigen::MatrixXd(2, 0), vector({0.5, -1.0}));
  const Posterior posterior(gp);
  EXPECT_EQ(predict(posterior, vector({3, 4})).mean, vector({0.5, -1.0}));
  EXPECT_EQ(predict(posterior, vector({3, 4})).variance, 2.5);
  EXPECT_EQ(posterior.predict_flow({3, 4}).mean, Eigen::Vector2d(0.5, -1.0));
  EXPECT_EQ(posterior.predict_flow({3, 4}).variance.x(), 2.5);
  EXPECT_EQ(posterior.linearise_flow({3, 4}).jacobian, Eigen::Matrix2d(Eigen::Matrix2d::Zero()));
}

TEST(Greedy, ChoosesUntilEverythingIsExplained) {
  for_seeds(seeds, [](Generator& make, unsigned) {
    const Kernel kernel = make.hyperparameters(2).kernel;
    const Eigen::MatrixXd candidates = make.points(2, 100);
    const Eigen::MatrixXd chosen = select_pseudo_inputs(kernel, candidates, 100, 0.05);
    EXPECT_LT(chosen.cols(), 100);
    const auto remaining = [&](const Eigen::MatrixXd& given) {
      const Eigen::MatrixXd cross = covariance(kernel, given, candidates);
      const Eigen::MatrixXd explained = cross.transpose() * covariance(kernel, given, given).ldlt().solve(cross);
      return (kernel.signal_variance - explained.diagonal().array()).maxCoeff() / kernel.signal_variance;
    };
    EXPECT_LT(remaining(chosen), 0.05 + 1e-9);
    EXPECT_GE(remaining(chosen.leftCols(chosen.cols() - 1)), 0.05 - 1e-9);
    EXPECT_EQ(select_pseudo_inputs(kernel, candidates, 7, 0.0).cols(), 7);
    EXPECT_EQ(select_pseudo_inputs(kernel, candidates, 7, 0.0), select_pseudo_inputs(kernel, candidates, 7, 0.0));
  });
}

TEST(Greedy, TakesTheFirstOfEqualsAndNeverACopy) {
  const Kernel kernel{1.0, vector({1.0})};
  // The ends are equally far from the first choice, the middle.
  const Eigen::MatrixXd chosen = select_pseudo_inputs(kernel, row({0, 2, 0, -2, 2}), 5, 0.0);
  EXPECT_EQ(chosen, row({0, 2, -2}));
  EXPECT_EQ(select_pseudo_inputs(kernel, Eigen::MatrixXd(1, 0), 5).cols(), 0);
}

TEST(PriorGp, RaisesTheJitterForCopiesOfAPseudoInput) {
  const SparseGp gp = prior_gp({1.0, vector({1.0})}, 0.1, row({0, 0, 1}), vector({0}), 0.0);
  EXPECT_GT(gp.jitter, 0.0);
  EXPECT_LE(gp.jitter, 1e-2);
  const SparseGp fitted = condition(gp, example_data());
  EXPECT_TRUE(predict(Posterior(fitted), vector({0.5})).mean.allFinite());
}

TEST(CallersMistakes, AreNamed) {
  const SparseGp gp = example_prior({0, 2});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto message_for = [&](const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs) {
    return message_of([&] { condition(gp, {inputs, outputs}); });
  };
  EXPECT_EQ(message_for(row({0, 1}), vector({1})), "condition: outputs is 1 x 1, must be 2 x 1");
  EXPECT_EQ(message_for(Eigen::MatrixXd::Zero(2, 1), vector({1})), "condition: inputs is 2 x 1, must be 1 x 1");
  EXPECT_EQ(message_for(row({nan}), vector({1})), "condition: inputs holds a number that is not finite");
  EXPECT_EQ(message_for(row({1}), vector({nan})), "condition: outputs holds a number that is not finite");
  EXPECT_EQ(message_of([&] { prior_gp(unit_kernel(), -1.0, row({0}), vector({0})); }),
            "sparse_gp: noise_variance = -1, must be positive and finite");
  EXPECT_EQ(message_of([&] {
              prior_gp({0.0, vector({1})}, 1.0, row({0}), vector({0}));
            }),
            "kernel: signal_variance = 0, must be positive and finite");
  EXPECT_EQ(message_of([&] { covariance(unit_kernel(), row({0}), Eigen::MatrixXd::Zero(2, 3)); }),
            "covariance: b.rows() = 2, must be the kernel's 1 input dimensions");
  EXPECT_EQ(message_of([&] { predict(Posterior(gp), vector({nan})); }),
            "posterior: x has 1 entries, must have 1 finite ones");
  EXPECT_NE(message_of([&] { Posterior(gp).predict_flow({0, 0}); }), "");
  std::vector<double> two(2);
  EXPECT_EQ(message_of([&] { Posterior(gp).predict(std::vector<double>{0.0}, two); }),
            "posterior: mean has size 2, must have 1");
  SparseGp broken = gp;
  broken.response(0, 0) = nan;
  EXPECT_EQ(message_of([&] { validate(broken); }), "sparse_gp: response holds a number that is not finite");
  broken = gp;
  broken.mean_response.resize(1);
  EXPECT_EQ(message_of([&] { validate(broken); }), "sparse_gp: mean_response is 1 x 1, must be 2 x 1");
  EXPECT_EQ(message_of([&] {
              fit_sparse_gp(example_data(), {unit_kernel(), 0.1}, {.selection_stop = 2.0});
            }),
            "gp: selection_stop = 2 is outside [0, 1]");
}

}  // namespace
}  // namespace sila::gp_tests
