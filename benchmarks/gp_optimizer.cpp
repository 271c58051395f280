// Which optimiser trains the GPs: dlib's box-constrained L-BFGS or Ceres's L-BFGS on a smooth reparametrisation of the
// box. All get the same objective, start, box, memory of steps and limit of evaluations; the counter `nlml` is the
// value that was reached, `evaluations` what it took. Without Ceres only dlib runs.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "gp/fit.hpp"
#include "gp/minimise.hpp"
#include "gp_data.hpp"

// As in src/gp/minimise.cpp: headers alone.
#define DLIB_TEST_FOR_ODR_VIOLATIONS_H_
#include <dlib/assert.h>
#undef DLIB_USE_BLAS
#undef DLIB_USE_LAPACK
#include <dlib/optimization/optimization.h>

#ifdef SILA_HAVE_CERES
#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>
#endif

namespace {

using sila::detail::Minimum;
using sila::detail::Stopping;
using sila::detail::ValueAndGradient;

/// The training of one transition: theta alone (4 numbers), or theta and Z.
struct Problem {
  sila::GpData data;
  Eigen::MatrixXd pseudo_inputs;
  bool joint = false;
  Eigen::VectorXd start, lower, upper, typical_step;

  ValueAndGradient operator()(const Eigen::VectorXd& v) const {
    const Eigen::Index numbers = joint ? pseudo_inputs.size() : 0;
    const auto theta_part = v.tail(4);
    const sila::Hyperparameters theta{{std::exp(theta_part(2) + theta_part(3)), theta_part.head(2).array().exp()},
                                      std::exp(theta_part(2))};
    const Eigen::MatrixXd z =
        joint ? Eigen::MatrixXd(v.head(numbers).reshaped(2, pseudo_inputs.cols())) : pseudo_inputs;
    const auto gradient = sila::negative_log_marginal_likelihood_gradient(data, theta, z);
    ValueAndGradient result{gradient.value, Eigen::VectorXd(v.size())};
    if (joint) result.gradient.head(numbers) = gradient.pseudo_inputs.reshaped();
    result.gradient.tail(4) << gradient.log_length_scales, gradient.log_noise_variance + gradient.log_signal_variance,
        gradient.log_signal_variance;
    return result;
  }
};

Problem make_problem(int points, bool joint, unsigned seed) {
  Problem problem{sila::benchmarks::transition_data(points, seed), {}, joint, {}, {}, {}, {}};
  problem.data.outputs.rowwise() -= problem.data.outputs.colwise().mean().eval();
  const sila::Hyperparameters theta = sila::benchmarks::walking_theta();
  problem.pseudo_inputs = sila::select_pseudo_inputs(theta.kernel, problem.data.inputs, 30);
  const Eigen::Index numbers = joint ? problem.pseudo_inputs.size() : 0;
  problem.start.resize(numbers + 4);
  problem.lower.resize(numbers + 4);
  problem.upper.resize(numbers + 4);
  if (joint) {
    problem.start.head(numbers) = problem.pseudo_inputs.reshaped();
    problem.lower.head(numbers).setConstant(problem.data.inputs.minCoeff() - 2.0);
    problem.upper.head(numbers).setConstant(problem.data.inputs.maxCoeff() + 2.0);
  }
  problem.start.tail(4) << std::log(2.0), std::log(2.0), std::log(0.09), std::log(0.64 / 0.09);
  problem.lower.tail(4) << std::log(0.5), std::log(0.5), std::log(0.0025), std::log(0.1);
  problem.upper.tail(4) << std::log(36.0), std::log(36.0), std::log(1.0), std::log(1000.0);
  problem.typical_step = Eigen::VectorXd::Constant(numbers + 4, 1.0 / std::sqrt(points));
  problem.typical_step.head(numbers).setConstant(2.0 *
                                                 std::sqrt(static_cast<double>(problem.pseudo_inputs.cols()) / points));
  return problem;
}

Minimum run_dlib(const Problem& problem, const Stopping& stopping) {
  return sila::detail::minimise_in_box(problem, {problem.start, problem.lower, problem.upper, problem.typical_step},
                                       stopping);
}

/// As if all numbers were of a kind.
Minimum run_dlib_unscaled(const Problem& problem, const Stopping& stopping) {
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(problem.start.size());
  return sila::detail::minimise_in_box(problem, {problem.start, problem.lower, problem.upper, ones}, stopping);
}

/// x = middle + half width * sin(t): the usual way to a box for an optimiser without bounds.
struct SineBox {
  explicit SineBox(const Problem& problem)
      : middle(0.5 * (problem.upper + problem.lower)), half_width(0.5 * (problem.upper - problem.lower)) {}

  Eigen::VectorXd to_box(const Eigen::VectorXd& t) const {
    return middle.array() + half_width.array() * t.array().sin();
  }
  Eigen::VectorXd from_box(const Eigen::VectorXd& x) const {
    return ((x - middle).array() / half_width.array()).max(-0.99).min(0.99).asin();
  }
  ValueAndGradient evaluate(const Problem& problem, const Eigen::VectorXd& t) const {
    ValueAndGradient at = problem(to_box(t));
    at.gradient.array() *= half_width.array() * t.array().cos();
    return at;
  }

  Eigen::VectorXd middle;
  Eigen::VectorXd half_width;
};

using Column = dlib::matrix<double, 0, 1>;

Eigen::VectorXd to_eigen(const Column& column) {
  return Eigen::Map<const Eigen::VectorXd>(&column(0), column.size());
}

/// dlib's unconstrained L-BFGS, whose line search looks for the Wolfe conditions, on the sine.
Minimum run_dlib_on_sine(const Problem& problem, const Stopping& stopping) {
  const SineBox box(problem);
  const Eigen::VectorXd first = box.from_box(problem.start);
  Column t(first.size());
  for (long i = 0; i < t.size(); ++i) t(i) = first(i);
  int evaluations = 0;
  Column asked;
  ValueAndGradient answer;
  const auto at = [&](const Column& where) -> const ValueAndGradient& {
    if (evaluations > 0 && asked == where) return answer;
    asked = where;
    answer = box.evaluate(problem, to_eigen(where));
    ++evaluations;
    return answer;
  };
  const auto gradient = [&](const Column& where) {
    Column result(where.size());
    const Eigen::VectorXd values = at(where).gradient;
    for (long i = 0; i < result.size(); ++i) result(i) = values(i);
    return result;
  };
  const double value = dlib::find_min(
      dlib::lbfgs_search_strategy(10),
      dlib::objective_delta_stop_strategy(stopping.relative_tolerance * 50.0,
                                          static_cast<unsigned long>(stopping.max_iterations)),
      [&](const Column& where) { return at(where).value; }, gradient, t, -1e100);
  return {box.to_box(to_eigen(t)), value, evaluations};
}

#ifdef SILA_HAVE_CERES
class OnSine final : public ceres::FirstOrderFunction {
 public:
  OnSine(const Problem& problem, int& evaluations) : problem_(problem), box_(problem), evaluations_(evaluations) {}

  int NumParameters() const override { return static_cast<int>(problem_.start.size()); }
  bool Evaluate(const double* parameters, double* cost, double* gradient) const override {
    const Eigen::Map<const Eigen::VectorXd> t(parameters, problem_.start.size());
    const ValueAndGradient at = box_.evaluate(problem_, t);
    ++evaluations_;
    *cost = at.value;
    if (gradient != nullptr) Eigen::Map<Eigen::VectorXd>(gradient, t.size()) = at.gradient;
    return true;
  }

 private:
  const Problem& problem_;
  SineBox box_;
  int& evaluations_;
};

Minimum run_ceres(const Problem& problem, const Stopping& stopping) {
  int evaluations = 0;
  const SineBox box(problem);
  Eigen::VectorXd t = box.from_box(problem.start);
  const ceres::GradientProblem gradient_problem(new OnSine(problem, evaluations));  // takes ownership
  ceres::GradientProblemSolver::Options options;
  options.line_search_direction_type = ceres::LBFGS;
  options.max_lbfgs_rank = 10;
  options.max_num_iterations = stopping.max_iterations;
  options.function_tolerance = stopping.relative_tolerance;
  options.gradient_tolerance = stopping.gradient_tolerance;
  options.logging_type = ceres::SILENT;
  ceres::GradientProblemSolver::Summary summary;
  ceres::Solve(options, gradient_problem, t.data(), &summary);
  return {box.to_box(t), summary.final_cost, evaluations};
}
#endif

template <class Run>
void train(benchmark::State& state, Run run) {
  Stopping stopping;
  stopping.max_iterations = static_cast<int>(state.range(2));
  constexpr unsigned problems = 16;
  std::vector<Problem> set;
  for (unsigned seed = 0; seed < problems; ++seed) {
    set.push_back(make_problem(static_cast<int>(state.range(0)), state.range(1) != 0, seed));
  }
  double value = 0.0;
  double evaluations = 0.0;
  for (auto _ : state) {
    value = evaluations = 0.0;
    for (const Problem& problem : set) {
      const Minimum minimum = run(problem, stopping);
      value += minimum.value / problems;
      evaluations += static_cast<double>(minimum.evaluations) / problems;
    }
  }
  state.counters["nlml"] = value;
  state.counters["evaluations"] = evaluations;
  state.counters["each"] =
      benchmark::Counter(problems, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void sizes(benchmark::internal::Benchmark* b) {
  b->ArgsProduct({{60, 150, 300}, {0, 1}, {50, 200}})
      ->ArgNames({"points", "joint", "limit"})
      ->Unit(benchmark::kMillisecond);
}
BENCHMARK_CAPTURE(train, dlib_box, run_dlib)->Apply(sizes);
BENCHMARK_CAPTURE(train, dlib_box_unscaled, run_dlib_unscaled)->Apply(sizes);
BENCHMARK_CAPTURE(train, dlib_sine, run_dlib_on_sine)->Apply(sizes);
#ifdef SILA_HAVE_CERES
BENCHMARK_CAPTURE(train, ceres, run_ceres)->Apply(sizes);
#endif

}  // namespace
