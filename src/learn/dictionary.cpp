#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "coding_state.hpp"
#include "learn/steps.hpp"

namespace sila {
namespace {

constexpr int kAlternationsPerRound = 4;
constexpr int kPolishAlternations = 20;
constexpr double kPolishDecrease = 1e-5;  ///< of CodingProblem::energy; alternation ends below it
constexpr double kSmallestSeed = 0.5;     ///< squared norm; that of an unexplained cell is 2
constexpr double kSmallestUse = 0.2;      ///< primitives whose coefficients are all smaller are removed
constexpr double kShortestArrow = 0.05;   ///< shorter arrows are left out of the finished primitive
constexpr double kSameSeedCosine = 0.5;   ///< of two seeds of one round with a larger cosine only the first is taken

/// A part of a track's path, [begin, end) in its visits.
struct Section {
  std::size_t track = 0, begin = 0, end = 0;
  double energy = 0.0;
  auto key() const { return std::pair(track, begin); }
};

/// Keys of the sections that were tried; each is tried once.
using TriedSections = std::set<std::pair<std::size_t, std::size_t>>;
using Seeds = std::vector<std::pair<Section, std::vector<CellArrow>>>;  ///< with the arrows of new primitives

bool tiles_differ(const CodingProblem& problem, int a, int b) {
  return tile_of(problem.grid, problem.cells[static_cast<std::size_t>(a)]) !=
         tile_of(problem.grid, problem.cells[static_cast<std::size_t>(b)]);
}

double squared_norm(std::span<const CellArrow> arrows) {
  return std::accumulate(arrows.begin(), arrows.end(), 0.0,
                         [](double sum, const CellArrow& arrow) { return sum + arrow.value.squaredNorm(); });
}

/// The sections of one track from which a primitive may grow, by the cut rule.
std::vector<Section> sections_of(const CodingProblem& problem, std::size_t track, std::span<const CellArrow> rest,
                                 double run_cells, CutRule cut) {
  std::vector<Section> sections;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const bool open = cut == CutRule::aligned || rest[i].value.squaredNorm() > 1.0;  // less is explained
    const bool starts = sections.empty() || sections.back().end != i ||
                        (cut == CutRule::aligned ? tiles_differ(problem, rest[i].cell, rest[i - 1].cell)
                                                 : static_cast<double>(i - sections.back().begin) >= run_cells);
    if (!open) continue;
    if (starts) sections.push_back({track, i, i, 0.0});
    sections.back().end = i + 1;
    sections.back().energy += rest[i].value.squaredNorm();
  }
  return sections;
}

std::vector<CellArrow> seed_on_support(const CodingProblem& problem, std::span<const CellArrow> section,
                                       const DictionaryConfig& config) {
  std::map<int, Arrow> cells;
  if (!config.support_mask) {
    for (std::size_t c = 0; c < problem.cells.size(); ++c) cells.emplace(static_cast<int>(c), Arrow::Zero());
  }
  for (const CellArrow& arrow : section) {
    const CellKey centre = problem.cells[static_cast<std::size_t>(arrow.cell)];
    for (int dx = -config.dilation_cells; dx <= config.dilation_cells; ++dx) {
      for (int dy = -config.dilation_cells; dy <= config.dilation_cells; ++dy) {
        const CellKey key{centre.x + dx, centre.y + dy};
        const auto found = std::lower_bound(problem.cells.begin(), problem.cells.end(), key);
        if (found == problem.cells.end() || *found != key) continue;  // no track there: it would stay zero
        if (config.cut == CutRule::aligned && tile_of(problem.grid, key) != tile_of(problem.grid, centre)) continue;
        cells.emplace(static_cast<int>(found - problem.cells.begin()), Arrow::Zero());
      }
    }
  }
  for (const CellArrow& arrow : section) cells[arrow.cell] = project_arrow(arrow.value);
  std::vector<CellArrow> seed;
  for (const auto& [cell, value] : cells) seed.push_back({cell, value});
  return seed;
}

double cosine(std::span<const CellArrow> a, std::span<const CellArrow> b) {
  double product = 0.0;
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    if (a[i].cell < b[j].cell)
      ++i;
    else if (b[j].cell < a[i].cell)
      ++j;
    else
      product += a[i++].value.dot(b[j++].value);
  }
  return product / std::sqrt(squared_norm(a) * squared_norm(b));
}

/// The sections with the largest unexplained energy: at most a tenth of the number of tracks, one a track, no two
/// similar.
Seeds choose_seeds(const CodingProblem& problem, const CodingState& state, const TriedSections& tried, double run_cells,
                   const DictionaryConfig& config) {
  Seeds best;
  for (std::size_t i = 0; i < problem.tracks.size(); ++i) {
    const std::vector<CellArrow> rest = residual(problem, state, i);
    Section top;
    for (const Section& section : sections_of(problem, i, rest, run_cells, config.cut)) {
      if (section.energy > top.energy && !tried.contains(section.key())) top = section;
    }
    if (top.energy < kSmallestSeed) continue;
    const auto unexplained = std::span(rest).subspan(top.begin, top.end - top.begin);
    best.emplace_back(top, std::vector<CellArrow>(unexplained.begin(), unexplained.end()));
  }
  std::ranges::stable_sort(best, std::ranges::greater(), [](const auto& seed) { return seed.first.energy; });
  const std::size_t room = static_cast<std::size_t>(config.max_primitives) - state.primitives.size();
  const std::size_t most = std::min(room, std::max<std::size_t>(1, problem.tracks.size() / 10));
  Seeds seeds;
  for (auto& [section, rest] : best) {
    std::vector<CellArrow> seed = seed_on_support(problem, rest, config);
    const bool known = std::any_of(seeds.begin(), seeds.end(),
                                   [&](const auto& other) { return cosine(other.second, seed) > kSameSeedCosine; });
    if (known || squared_norm(seed) < kSmallestSeed) continue;
    seeds.emplace_back(section, std::move(seed));
    if (seeds.size() == most) break;
  }
  return seeds;
}

/// The objective with the price of each primitive.
double priced(const CodingProblem& problem, const CodingState& state) {
  return state.objective + problem.gain_cells * static_cast<double>(state.primitives.size());
}

/// A state, and the objective after each step towards it.
struct TracedState {
  CodingState state;
  std::vector<double> objectives;
};

/// Updates primitives and codes in turn, at most `times` times, until the objective hardly falls.
TracedState alternate(const CodingProblem& problem, TracedState traced, int times) {
  CodingState& state = traced.state;
  state = with_new_codes(problem, std::move(state));
  for (int round = 0; round < times; ++round) {
    const double before = state.objective;
    state = with_new_codes(problem, with_new_primitives(problem, std::move(state)));
    traced.objectives.push_back(priced(problem, state));
    if (before - state.objective < kPolishDecrease * problem.energy) break;
  }
  return traced;
}

/// Removes, newest first, each primitive from index `first` on whose removal costs less than its price.
CodingState drop_unprofitable(const CodingProblem& problem, CodingState state, std::size_t first) {
  Overlap overlap = overlap_of(problem, state);
  std::vector<bool> drop(state.primitives.size(), false);
  for (std::size_t k = state.primitives.size(); k-- > first;) {
    Removal removal = removal_of(problem, state, overlap, static_cast<int>(k));
    if (removal.cost >= problem.gain_cells) continue;
    for (auto& [track, code] : removal.codes) state.codes[track] = std::move(code);
    state.objective += removal.cost;
    // Its index stays, with zero norm, so that no code uses it.
    overlap.gram.row(static_cast<Eigen::Index>(k)).setZero();
    overlap.gram.col(static_cast<Eigen::Index>(k)).setZero();
    drop[k] = true;
  }
  return without(state, drop);
}

/// Adds rounds of new primitives until no section is left; a round that does not lower the priced objective is undone.
TracedState grow(const CodingProblem& problem, double run_cells, const DictionaryConfig& config) {
  CodingState state{{}, std::vector<std::vector<Coefficient>>(problem.tracks.size()), problem.energy};
  std::vector<double> objectives{priced(problem, state)};
  TriedSections tried_sections;
  while (static_cast<int>(state.primitives.size()) < config.max_primitives) {
    auto seeds = choose_seeds(problem, state, tried_sections, run_cells, config);
    if (seeds.empty()) break;
    CodingState tried = state;
    for (auto& [section, seed] : seeds) {
      tried.primitives.push_back(std::move(seed));
      tried_sections.insert(section.key());
    }
    tried = alternate(problem, {std::move(tried), {}}, kAlternationsPerRound).state;
    tried = drop_unprofitable(problem, std::move(tried), state.primitives.size());
    if (priced(problem, tried) >= priced(problem, state)) continue;
    state = std::move(tried);
    objectives.push_back(priced(problem, state));
  }
  return {std::move(state), std::move(objectives)};
}

/// The state without primitives that no track uses much.
CodingState without_rarely_used(const CodingProblem& problem, const CodingState& state) {
  std::vector<bool> drop(state.primitives.size(), true);
  for (const auto& code : state.codes) {
    for (const Coefficient& used : code) {
      if (used.value > kSmallestUse) drop[static_cast<std::size_t>(used.primitive)] = false;
    }
  }
  return with_new_codes(problem, without(state, drop));
}

MotionPrimitive finished(const CodingProblem& problem, std::span<const CellArrow> arrows) {
  MotionPrimitive primitive;
  for (const CellArrow& arrow : arrows) {
    const Vector2 velocity = arrow.value.head<2>();
    if (velocity.norm() < kShortestArrow) continue;
    primitive.cells.push_back(
        {problem.cells[static_cast<std::size_t>(arrow.cell)], velocity / std::max(1.0, velocity.norm())});
  }
  return primitive;
}

/// A mean heading shorter than this means that the person looped or turned about inside the cell.
constexpr double kShortestMeanHeading = 0.3;
/// No pedestrian passed through the cells between two positions that are farther apart than this speed allows.
constexpr double kFastest_mps = 100.0;

struct HeadingSum {
  Vector2 sum = Vector2::Zero();
  int samples = 0;
  std::size_t order = 0;
};

}  // namespace

Eigen::Vector3d project_arrow(const Eigen::Vector3d& arrow) {
  const double n = std::hypot(arrow.x(), arrow.y());
  double b = arrow.z(), length = n;
  if (n > b) {  // outside the cone: onto its side, or onto its tip
    if (n <= -b) return Eigen::Vector3d::Zero();
    b = (n + b) / 2.0;
    length = b;
  }
  if (b > 1.0) {
    b = 1.0;
    length = std::min(n, 1.0);
  }
  const double scale = n > 0.0 ? length / n : 0.0;
  return {arrow.x() * scale, arrow.y() * scale, b};
}

Dictionary learn_dictionary(std::span<const GridVector> tracks, const Grid& grid, double gain_cells, double run_cells,
                            const DictionaryConfig& config) {
  const CodingProblem problem(tracks, grid, gain_cells);
  Dictionary dictionary;
  auto [state, objectives] = alternate(problem, grow(problem, run_cells, config), kPolishAlternations);
  dictionary.objective = std::move(objectives);
  state = drop_unprofitable(problem, std::move(state), 0);
  dictionary.objective.push_back(priced(problem, state));
  state = without_rarely_used(problem, state);

  std::vector<bool> empty;
  for (const auto& cells : state.primitives) {
    MotionPrimitive primitive = finished(problem, cells);
    empty.push_back(primitive.cells.empty());
    if (!empty.back()) dictionary.primitives.push_back(std::move(primitive));
  }
  dictionary.codes = without(state, empty).codes;
  return dictionary;
}

GridVector to_grid_vector(const CurbTrajectory& track, const Grid& grid) {
  std::map<CellKey, HeadingSum> cells;
  const auto add = [&](const Vector2& position, const Vector2& heading) {
    HeadingSum& cell =
        cells.try_emplace(cell_of(grid, position), HeadingSum{Vector2::Zero(), 0, cells.size()}).first->second;
    cell.sum += heading;
    cell.samples += 1;
  };
  for (std::size_t t = 0; t < track.positions.size(); ++t) {
    const Vector2& velocity = track.velocities[t];
    const double speed_mps = velocity_to_world(track.frame, velocity).norm();
    if (speed_mps < DictionaryConfig::min_speed_mps || velocity.norm() == 0.0) continue;
    const Vector2 heading = velocity.normalized();
    add(track.positions[t], heading);
    if (t + 1 == track.positions.size()) continue;
    const Vector2 step = track.positions[t + 1] - track.positions[t];
    const double step_m = velocity_to_world(track.frame, step).norm();
    if (step_m > kFastest_mps * (track.times_s[t + 1] - track.times_s[t])) continue;
    const int parts = static_cast<int>(std::min(1000.0, std::ceil(step.norm() / (0.5 * grid.cell))));
    for (int k = 1; k < parts; ++k) add(track.positions[t] + step * k / parts, heading);
  }
  GridVector vector{std::vector<CellKey>(cells.size()), std::vector<Vector2>(cells.size(), Vector2::Zero())};
  for (const auto& [key, cell] : cells) {
    const Vector2 mean = cell.sum / cell.samples;
    vector.path[cell.order] = key;
    if (mean.norm() >= kShortestMeanHeading) vector.directions[cell.order] = mean.normalized();
  }
  return vector;
}

}  // namespace sila
