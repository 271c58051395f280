#include "coding_state.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "sila/learn/sparse_coding.hpp"

namespace sila {
namespace {

using PrimitivesAt = decltype(Overlap::at);

PrimitivesAt primitives_at(const CodingProblem& problem, const CodingState& state) {
  PrimitivesAt at(problem.cells.size());
  for (std::size_t k = 0; k < state.primitives.size(); ++k) {
    for (const CellArrow& arrow : state.primitives[k]) {
      at[static_cast<std::size_t>(arrow.cell)].emplace_back(static_cast<int>(k), &arrow.value);
    }
  }
  return at;
}

Eigen::MatrixXd gram_of(const CodingState& state, const PrimitivesAt& at) {
  const auto count = static_cast<Eigen::Index>(state.primitives.size());
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(count, count);
  for (const auto& here : at) {
    for (const auto& [k, a] : here) {
      for (const auto& [l, b] : here) gram(k, l) += a->dot(*b);
    }
  }
  return gram;
}

/// The lasso of one track on the primitives that share a cell with it.
struct TrackLasso {
  std::vector<int> primitives;
  Eigen::MatrixXd gram;
  Eigen::VectorXd products;
  Eigen::VectorXd start;
};

TrackLasso track_lasso(const CodingProblem& problem, const CodingState& state, const Overlap& overlap,
                       std::size_t track) {
  std::vector<std::pair<int, double>> shares;
  for (const CellArrow& visit : problem.tracks[track]) {
    for (const auto& [k, arrow] : overlap.at[static_cast<std::size_t>(visit.cell)])
      shares.emplace_back(k, arrow->dot(visit.value));
  }
  std::stable_sort(shares.begin(), shares.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::pair<int, double>> products;
  for (const auto& [k, share] : shares) {
    if (products.empty() || products.back().first != k) products.emplace_back(k, 0.0);
    products.back().second += share;
  }
  TrackLasso lasso;
  const auto count = static_cast<Eigen::Index>(products.size());
  lasso.products.resize(count);
  for (const auto& [k, product] : products) {
    lasso.products(static_cast<Eigen::Index>(lasso.primitives.size())) = product;
    lasso.primitives.push_back(k);
  }
  lasso.gram = overlap.gram(lasso.primitives, lasso.primitives);
  lasso.start = Eigen::VectorXd::Zero(count);
  for (const Coefficient& used : state.codes[track]) {
    const auto place = std::lower_bound(lasso.primitives.begin(), lasso.primitives.end(), used.primitive);
    if (place != lasso.primitives.end() && *place == used.primitive)
      lasso.start(place - lasso.primitives.begin()) = used.value;
  }
  return lasso;
}

std::vector<Coefficient> code_of(const TrackLasso& lasso, const Eigen::VectorXd& s) {
  std::vector<Coefficient> code;
  for (Eigen::Index k = 0; k < s.size(); ++k) {
    if (s(k) > 0.0) code.push_back({lasso.primitives[static_cast<std::size_t>(k)], s(k)});
  }
  return code;
}

/// The part of the objective that the code of one track changes.
double code_cost(const TrackLasso& lasso, const Eigen::VectorXd& s, double penalty) {
  return 0.5 * s.dot(lasso.gram * s) - lasso.products.dot(s) + penalty * s.sum();
}

}  // namespace

CodingProblem::CodingProblem(std::span<const GridVector> vectors, const Grid& grid_, double activeness_weight)
    : grid(grid_), g(std::sqrt(activeness_weight)) {
  std::set<CellKey> keys;
  for (const GridVector& vector : vectors) keys.insert(vector.path.begin(), vector.path.end());
  cells.assign(keys.begin(), keys.end());
  visits.resize(cells.size());
  tracks.resize(vectors.size());
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    for (std::size_t c = 0; c < vectors[i].path.size(); ++c) {
      const Vector2& direction = vectors[i].directions[c];
      if (direction.isZero()) continue;
      const auto place = std::lower_bound(cells.begin(), cells.end(), vectors[i].path[c]) - cells.begin();
      const Arrow value(direction.x(), direction.y(), g);
      tracks[i].push_back({static_cast<int>(place), value});
      visits[static_cast<std::size_t>(place)].push_back({static_cast<int>(i), value});
      energy += 0.5 * value.squaredNorm();
    }
  }
}

CodingState with_new_codes(const CodingProblem& problem, CodingState state, double penalty) {
  const Overlap overlap = overlap_of(problem, state);
  state.objective = problem.energy;
  for (std::size_t i = 0; i < problem.tracks.size(); ++i) {
    const TrackLasso lasso = track_lasso(problem, state, overlap, i);
    const Eigen::VectorXd s = nonnegative_lasso(lasso.gram, lasso.products, penalty, lasso.start);
    state.codes[i] = code_of(lasso, s);
    state.objective += code_cost(lasso, s, penalty);
  }
  return state;
}

CodingState with_new_primitives(const CodingProblem& problem, CodingState state) {
  const std::size_t count = state.primitives.size();
  std::vector<std::map<int, double>> code_gram(count);  // A = S S'
  std::vector<std::vector<double>> use(count, std::vector<double>(problem.tracks.size(), 0.0));
  for (std::size_t i = 0; i < state.codes.size(); ++i) {
    for (const Coefficient& a : state.codes[i]) {
      use[static_cast<std::size_t>(a.primitive)][i] = a.value;
      for (const Coefficient& b : state.codes[i])
        code_gram[static_cast<std::size_t>(a.primitive)][b.primitive] += a.value * b.value;
    }
  }
  const PrimitivesAt at =
      primitives_at(problem, state);  // points into state: later primitives see the new earlier ones
  for (std::size_t k = 0; k < count; ++k) {
    const auto self = code_gram[k].find(static_cast<int>(k));
    if (self == code_gram[k].end() || self->second <= 1e-8) continue;
    for (CellArrow& arrow : state.primitives[k]) {
      const auto cell = static_cast<std::size_t>(arrow.cell);
      Arrow pull = Arrow::Zero();
      for (const CellArrow& visit : problem.visits[cell])
        pull += use[k][static_cast<std::size_t>(visit.cell)] * visit.value;
      for (const auto& [l, value] : at[cell]) {
        const auto shared = code_gram[k].find(l);
        if (shared != code_gram[k].end()) pull -= shared->second * *value;
      }
      arrow.value = project_arrow(arrow.value + pull / self->second, problem.g);
    }
  }
  return state;
}

std::vector<CellArrow> residual(const CodingProblem& problem, const CodingState& state, std::size_t track) {
  std::vector<CellArrow> rest = problem.tracks[track];
  for (const Coefficient& used : state.codes[track]) {
    const std::vector<CellArrow>& primitive = state.primitives[static_cast<std::size_t>(used.primitive)];
    for (CellArrow& left : rest) {
      const auto place = std::lower_bound(primitive.begin(), primitive.end(), left.cell,
                                          [](const CellArrow& arrow, int cell) { return arrow.cell < cell; });
      if (place != primitive.end() && place->cell == left.cell) left.value -= used.value * place->value;
    }
  }
  return rest;
}

Overlap overlap_of(const CodingProblem& problem, const CodingState& state) {
  Overlap overlap{primitives_at(problem, state), {}};
  overlap.gram = gram_of(state, overlap.at);
  return overlap;
}

Removal removal_of(const CodingProblem& problem, const CodingState& state, const Overlap& overlap, int primitive,
                   double penalty) {
  Removal removal;
  for (std::size_t i = 0; i < state.codes.size(); ++i) {
    const bool uses = std::any_of(state.codes[i].begin(), state.codes[i].end(),
                                  [&](const Coefficient& used) { return used.primitive == primitive; });
    if (!uses) continue;
    TrackLasso lasso = track_lasso(problem, state, overlap, i);
    const double before = code_cost(lasso, lasso.start, penalty);
    const auto place =
        std::lower_bound(lasso.primitives.begin(), lasso.primitives.end(), primitive) - lasso.primitives.begin();
    lasso.gram.row(place).setZero();
    lasso.gram.col(place).setZero();
    lasso.products(place) = 0.0;
    lasso.start(place) = 0.0;
    const Eigen::VectorXd s = nonnegative_lasso(lasso.gram, lasso.products, penalty, lasso.start);
    removal.cost += code_cost(lasso, s, penalty) - before;
    removal.codes.emplace_back(i, code_of(lasso, s));
  }
  return removal;
}

Overlap without(Overlap overlap, const CodingState& state, int primitive) {
  for (const CellArrow& arrow : state.primitives[static_cast<std::size_t>(primitive)]) {
    std::erase_if(overlap.at[static_cast<std::size_t>(arrow.cell)],
                  [&](const auto& here) { return here.first == primitive; });
  }
  overlap.gram.row(primitive).setZero();
  overlap.gram.col(primitive).setZero();
  return overlap;
}

CodingState compacted(const CodingState& state, const std::vector<bool>& drop) {
  CodingState rest;
  rest.objective = state.objective;
  std::vector<int> new_index(drop.size(), -1);
  for (std::size_t k = 0; k < drop.size(); ++k) {
    if (drop[k]) continue;
    new_index[k] = static_cast<int>(rest.primitives.size());
    rest.primitives.push_back(state.primitives[k]);
  }
  for (const auto& code : state.codes) {
    rest.codes.emplace_back();
    for (const Coefficient& used : code) {
      const int index = new_index[static_cast<std::size_t>(used.primitive)];
      if (index >= 0) rest.codes.back().push_back({index, used.value});
    }
  }
  return rest;
}

}  // namespace sila
