#include <benchmark/benchmark.h>

#include <vector>

#include "gp/fit.hpp"
#include "gp/fuse_gps.hpp"
#include "gp/posterior.hpp"
#include "gp_data.hpp"

namespace {

using sila::benchmarks::transition_data;
using sila::benchmarks::walking_theta;

/// Dense: length scales so short that the limit of 30 pseudo-inputs is reached.
sila::Hyperparameters theta_of(bool dense) {
  sila::Hyperparameters theta = walking_theta();
  if (dense) theta.kernel.length_scales.setConstant(0.7);
  return theta;
}

void fit_fixed(benchmark::State& state) {
  const sila::GpData data = transition_data(static_cast<int>(state.range(0)), 1);
  const sila::Hyperparameters theta = theta_of(state.range(1) != 0);
  for (auto _ : state) benchmark::DoNotOptimize(sila::fit_sparse_gp(data, theta));
  state.counters["pseudo_inputs"] = static_cast<double>(sila::fit_sparse_gp(data, theta).pseudo_inputs.cols());
}
BENCHMARK(fit_fixed)
    ->ArgsProduct({{50, 150, 300}, {0, 1}})
    ->ArgNames({"points", "dense"})
    ->Unit(benchmark::kMicrosecond);

void fit_optimised(benchmark::State& state) {
  const sila::GpData data = transition_data(static_cast<int>(state.range(0)), 1);
  sila::GpConfig config;
  config.pseudo_inputs = sila::PseudoInputChoice::optimised;
  for (auto _ : state) benchmark::DoNotOptimize(sila::fit_sparse_gp(data, walking_theta(), config));
}
BENCHMARK(fit_optimised)->Arg(50)->Arg(150)->Arg(300)->ArgName("points")->Unit(benchmark::kMillisecond);

void condition_on_200(benchmark::State& state) {
  const sila::SparseGp gp = sila::fit_sparse_gp(transition_data(300, 1), theta_of(state.range(0) != 0));
  const sila::GpData more = transition_data(200, 2);
  for (auto _ : state) benchmark::DoNotOptimize(sila::condition(gp, more));
}
BENCHMARK(condition_on_200)->Arg(0)->Arg(1)->ArgName("dense")->Unit(benchmark::kMicrosecond);

/// A stored GP and new samples under the same theta.
void fuse_with_data(benchmark::State& state) {
  const sila::SparseGp gp = sila::fit_sparse_gp(transition_data(300, 1), theta_of(state.range(0) != 0));
  const sila::GpData more = transition_data(150, 2);
  const std::vector<const sila::SparseGp*> parts{&gp};
  for (auto _ : state) benchmark::DoNotOptimize(sila::fuse_gps(parts, more));
}
BENCHMARK(fuse_with_data)->Arg(0)->Arg(1)->ArgName("dense")->Unit(benchmark::kMicrosecond);

/// Two stored GPs on different pseudo-inputs.
void fuse_stored(benchmark::State& state) {
  const sila::SparseGp first = sila::fit_sparse_gp(transition_data(300, 1), theta_of(state.range(0) != 0));
  const sila::SparseGp second = sila::fit_sparse_gp(transition_data(150, 2), theta_of(state.range(0) != 0));
  const std::vector<const sila::SparseGp*> parts{&first, &second};
  const sila::GpData none{Eigen::MatrixXd(2, 0), Eigen::MatrixXd(0, 2)};
  for (auto _ : state) benchmark::DoNotOptimize(sila::fuse_gps(parts, none));
}
BENCHMARK(fuse_stored)->Arg(0)->Arg(1)->ArgName("dense")->Unit(benchmark::kMicrosecond);

void make_posterior(benchmark::State& state) {
  const sila::SparseGp gp = sila::fit_sparse_gp(transition_data(300, 1), theta_of(state.range(0) != 0));
  for (auto _ : state) benchmark::DoNotOptimize(sila::Posterior(gp));
}
BENCHMARK(make_posterior)->Arg(0)->Arg(1)->ArgName("dense")->Unit(benchmark::kMicrosecond);

void predict_one(benchmark::State& state) {
  const sila::Posterior posterior(sila::fit_sparse_gp(transition_data(300, 1), theta_of(state.range(0) != 0)));
  Eigen::Vector2d x(6.0, 2.0);
  for (auto _ : state) benchmark::DoNotOptimize(posterior.predict_flow(x));
}
BENCHMARK(predict_one)->Arg(0)->Arg(1)->ArgName("dense");

void linearise_one(benchmark::State& state) {
  const sila::Posterior posterior(sila::fit_sparse_gp(transition_data(300, 1), theta_of(state.range(0) != 0)));
  Eigen::Vector2d x(6.0, 2.0);
  for (auto _ : state) benchmark::DoNotOptimize(posterior.linearise_flow(x));
}
BENCHMARK(linearise_one)->Arg(0)->Arg(1)->ArgName("dense");

}  // namespace
