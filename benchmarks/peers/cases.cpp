// What tools/bench_peers compares with GPy and scikit-learn: the cases are written for them, and solved here.
//
//   peer_cases write DIR        gp_inputs_K.csv, gp_outputs_K.csv, gp_pseudo_inputs_K.csv for K = 1, 2, ...,
//   dictionary.csv peer_cases solve N          each N times; prints one JSON object, seconds and what was found

#include <algorithm>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "../gp_data.hpp"
#include "gp/fit.hpp"
#include "gp/statistics.hpp"
#include "learn/steps.hpp"
#include "sila/config.hpp"
#include "sila/core/sampling.hpp"
#include "sila/learn/learn.hpp"
#include "sila/sim/simulate.hpp"
#include "sila/train/episode.hpp"

namespace {

using nlohmann::ordered_json;

constexpr int kPoints = 300, kPseudoInputs = 20, kIterations = 50;
constexpr unsigned kGpCases = 5;
constexpr int kTracks = 840;  ///< as in the paper

/// One output, for GPy's FITC knows no more.
sila::GpData one_output(unsigned seed) {
  sila::GpData data = sila::benchmarks::transition_data(kPoints, seed);
  data.outputs.conservativeResize(Eigen::NoChange, 1);
  return data;
}

struct GpCase {
  explicit GpCase(unsigned seed) : data(one_output(seed)) {}

  sila::GpData data;
  sila::Hyperparameters start = sila::benchmarks::walking_theta();
  Eigen::MatrixXd pseudo_inputs = data.inputs(
      Eigen::all,
      sila::detail::select_greedily(start.kernel, data.inputs, kPseudoInputs, 0.0, sila::default_jitter).chosen);
};

/// The paper's simulated tracks on the grid.
struct DictionaryCase {
  sila::Config config;
  std::vector<sila::GridVector> vectors;
  sila::ModelSettings settings;
  std::vector<sila::CellKey> cells;

  DictionaryCase() {
    sila::SimulationConfig simulation = config.simulate;
    simulation.tracks = kTracks;
    const sila::Simulation simulated = sila::simulate(simulation);
    const sila::CurbFrame frame = sila::primary_corner(simulated.scene).frame;
    settings = sila::settings_for({}, frame, config.episode);
    std::set<sila::CellKey> seen;
    for (const sila::Trajectory& track : simulated.tracks) {
      vectors.push_back(sila::to_grid_vector(sila::resample(track, frame, config.episode.sampling), settings.grid));
      seen.insert(vectors.back().path.begin(), vectors.back().path.end());
    }
    cells.assign(seen.begin(), seen.end());
  }

  Eigen::Index column(const sila::CellKey& key) const {
    return 2 * (std::lower_bound(cells.begin(), cells.end(), key) - cells.begin());
  }

  /// One track a row: x and y of the direction in each cell.
  Eigen::MatrixXd matrix() const {
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(kTracks, 2 * static_cast<Eigen::Index>(cells.size()));
    for (std::size_t i = 0; i < vectors.size(); ++i) {
      for (std::size_t c = 0; c < vectors[i].path.size(); ++c)
        rows.block<1, 2>(static_cast<Eigen::Index>(i), column(vectors[i].path[c])) =
            vectors[i].directions[c].transpose();
    }
    return rows;
  }
};

void write(const std::string& path, const Eigen::MatrixXd& rows) {
  std::ofstream file(path);
  const Eigen::IOFormat csv(Eigen::FullPrecision, Eigen::DontAlignCols, ",", "\n");
  file << rows.format(csv) << "\n";
  if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
}

/// Of the processor, so that other work on the machine counts little.
template <class Work>
double seconds(const Work& work) {
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

std::vector<double> numbers(const Eigen::MatrixXd& matrix) {
  return {matrix.data(), matrix.data() + matrix.size()};
}

/// Theta and pseudo-inputs by gradient from the same start as the peer's, with so many iterations.
ordered_json solve_gp(const GpCase& problem, int iterations, int times) {
  sila::GpConfig config;
  config.pseudo_inputs = sila::PseudoInputChoice::optimised;
  config.max_pseudo_inputs = kPseudoInputs;
  config.selection_stop = 0.0;
  config.max_iterations = iterations;
  sila::SparseGp gp;
  std::vector<double> each;
  for (int k = 0; k < times; ++k)
    each.push_back(seconds([&] { gp = sila::fit_sparse_gp(problem.data, problem.start, config); }));
  return {{"seconds", each},
          {"signal_variance", gp.kernel.signal_variance},
          {"length_scales", numbers(gp.kernel.length_scales)},
          {"noise_variance", gp.noise_variance},
          {"pseudo_inputs", numbers(gp.pseudo_inputs)}};
}

/// One list a case: what more and more iterations find.
ordered_json solve_gps(int times) {
  ordered_json cases = ordered_json::array();
  for (unsigned seed = 1; seed <= kGpCases; ++seed) {
    const GpCase problem(seed);
    ordered_json found = ordered_json::array();
    for (int iterations = 2; iterations <= kIterations; iterations += 2)
      found.push_back(solve_gp(problem, iterations, times));
    cases.push_back(found);
  }
  return cases;
}

/// The default, each primitive within a tile; 0: as many as pay.
sila::DictionaryConfig of_tiles(int most_primitives) {
  sila::DictionaryConfig config = sila::Config{}.episode.learn.dictionary;
  if (most_primitives > 0) config.max_primitives = most_primitives;
  return config;
}

/// Without tiles: a primitive may be a whole route.
sila::DictionaryConfig of_routes(int most_primitives) {
  sila::DictionaryConfig config = of_tiles(most_primitives);
  config.cut = sila::CutRule::first_unexplained;
  config.run_m = 100.0;
  return config;
}

/// Error: what the primitives leave of the directions, as a share of them.
ordered_json solve_dictionary(int times, const std::string& name, const sila::DictionaryConfig& config) {
  const DictionaryCase problem;
  sila::Dictionary dictionary;
  std::vector<double> each;
  const double cell_m = problem.config.episode.learn.grid.cell_m;
  for (int k = 0; k < times; ++k) {
    each.push_back(seconds([&] {
      dictionary = sila::learn_dictionary(problem.vectors, problem.settings.grid, config.gain_m / cell_m,
                                          config.run_m / cell_m, config);
    }));
  }
  const Eigen::MatrixXd wanted = problem.matrix();
  Eigen::MatrixXd left = wanted;
  for (std::size_t i = 0; i < dictionary.codes.size(); ++i) {
    for (const sila::Coefficient& used : dictionary.codes[i]) {
      for (const auto& cell : dictionary.primitives[static_cast<std::size_t>(used.primitive)].cells)
        left.block<1, 2>(static_cast<Eigen::Index>(i), problem.column(cell.cell)) -=
            used.value * cell.velocity.transpose();
    }
  }
  return {{"name", name},
          {"seconds", each},
          {"vectors", problem.vectors.size()},
          {"cells", problem.cells.size()},
          {"primitives", dictionary.primitives.size()},
          {"error", left.squaredNorm() / wanted.squaredNorm()}};
}

int run(const std::vector<std::string>& words) {
  if (words.size() == 2 && words[0] == "write") {
    for (unsigned seed = 1; seed <= kGpCases; ++seed) {
      const GpCase gp(seed);
      const std::string end = "_" + std::to_string(seed) + ".csv";
      write(words[1] + "/gp_inputs" + end, gp.data.inputs.transpose());
      write(words[1] + "/gp_outputs" + end, gp.data.outputs);
      write(words[1] + "/gp_pseudo_inputs" + end, gp.pseudo_inputs.transpose());
    }
    write(words[1] + "/dictionary.csv", DictionaryCase().matrix());
    return 0;
  }
  if (words.size() == 2 && words[0] == "solve") {
    const int times = std::stoi(words[1]);
    std::cout << ordered_json{{"gps", solve_gps(times)},
                              {"dictionaries",
                               {solve_dictionary(times, "primitives as long as a track", of_routes(29)),
                                solve_dictionary(times, "primitives of a tile", of_tiles(29)),
                                solve_dictionary(times, "primitives of a tile", of_tiles(58)),
                                solve_dictionary(times, "primitives of a tile", of_tiles(0))}}}
                     .dump()
              << "\n";
    return 0;
  }
  std::cerr << "peer_cases: expected `write DIR` or `solve TIMES`\n";
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::cerr << "peer_cases: " << error.what() << "\n";
    return 1;
  }
}
