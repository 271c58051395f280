#include "coding_state.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <optional>
#include <set>

#include "learn/sparse_coding.hpp"

namespace sila {
namespace {

/// The primitives of each cell; inner products are left empty.
Overlap primitives_at(const CodingProblem& problem, const CodingState& state) {
  Overlap overlap;
  overlap.first.assign(problem.cells.size() + 1, 0);
  for (const auto& primitive : state.primitives) {
    for (const CellArrow& arrow : primitive) ++overlap.first[static_cast<std::size_t>(arrow.cell) + 1];
  }
  std::partial_sum(overlap.first.begin(), overlap.first.end(), overlap.first.begin());
  overlap.entries.resize(overlap.first.back());
  std::vector<std::size_t> next(overlap.first.begin(), overlap.first.end() - 1);
  for (std::size_t k = 0; k < state.primitives.size(); ++k) {
    for (const CellArrow& arrow : state.primitives[k])
      overlap.entries[next[static_cast<std::size_t>(arrow.cell)]++] = {static_cast<int>(k), &arrow.value};
  }
  return overlap;
}

Eigen::MatrixXd gram_of(const CodingProblem& problem, const CodingState& state, const Overlap& overlap) {
  const auto count = static_cast<Eigen::Index>(state.primitives.size());
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(count, count);
  for (std::size_t cell = 0; cell < problem.cells.size(); ++cell) {
    const auto here = overlap.at(static_cast<int>(cell));
    for (const Overlap::Entry& a : here) {
      for (const Overlap::Entry& b : here) gram(a.primitive, b.primitive) += a.arrow->dot(*b.arrow);
    }
  }
  return gram;
}

/// The lasso of one track, on the primitives that share a cell with it and may get a positive coefficient.
struct TrackLasso {
  std::vector<int> primitives;
  Eigen::VectorXd products;  ///< inner products of the primitives with the track
  Eigen::VectorXd start;     ///< the present coefficients
};

/// For each primitive its inner product with a track; null if it shares no cell with it. All are null between tracks.
using Products = std::vector<std::optional<double>>;

/// Whether a coefficient of 0 stays 0 whatever the others are. No arrow is longer than its activeness, so all inner
/// products of primitives are at least 0, and the others can only lower its gain.
bool stays_zero(double product) {
  return product <= DictionaryConfig::sparsity;
}

double coefficient_of(std::span<const Coefficient> code, int primitive) {
  const auto used = std::ranges::lower_bound(code, primitive, {}, &Coefficient::primitive);
  return used != code.end() && used->primitive == primitive ? used->value : 0.0;
}

TrackLasso track_lasso(const CodingProblem& problem, const CodingState& state, const Overlap& overlap,
                       std::size_t track, Products& products) {
  std::vector<int> touched;  // primitives that share a cell with the track
  for (const CellArrow& visit : problem.tracks[track]) {
    for (const Overlap::Entry& entry : overlap.at(visit.cell)) {
      std::optional<double>& product = products[static_cast<std::size_t>(entry.primitive)];
      if (!product) touched.push_back(entry.primitive);
      product = product.value_or(0.0) + entry.arrow->dot(visit.value);
    }
  }
  const std::vector<Coefficient>& code = state.codes[track];
  const auto product_of = [&](int primitive) -> auto& {
    return products[static_cast<std::size_t>(primitive)];
  };
  TrackLasso lasso;
  std::ranges::copy_if(touched, std::back_inserter(lasso.primitives), [&](int primitive) {
    return !stays_zero(*product_of(primitive)) || coefficient_of(code, primitive) > 0.0;
  });
  std::ranges::sort(lasso.primitives);
  lasso.products.resize(std::ssize(lasso.primitives));
  lasso.start.resizeLike(lasso.products);
  for (Eigen::Index j = 0; j < lasso.start.size(); ++j) {
    const int primitive = lasso.primitives[static_cast<std::size_t>(j)];
    lasso.products(j) = *product_of(primitive);
    lasso.start(j) = coefficient_of(code, primitive);
  }
  for (const int primitive : touched) product_of(primitive).reset();
  return lasso;
}

std::vector<Coefficient> code_of(const TrackLasso& lasso, const Eigen::VectorXd& s) {
  std::vector<Coefficient> code;
  for (Eigen::Index k = 0; k < s.size(); ++k) {
    if (s(k) > 0.0) code.push_back({lasso.primitives[static_cast<std::size_t>(k)], s(k)});
  }
  return code;
}

/// The entries of the gram matrix that one track needs; zero for the primitive at index `removed`, if any.
struct TrackGram {
  const Overlap& overlap;
  const std::vector<int>& primitives;
  Eigen::Index removed = -1;
  double operator()(Eigen::Index i, Eigen::Index k) const {
    if (i == removed || k == removed) return 0.0;
    return overlap.gram(primitives[static_cast<std::size_t>(i)], primitives[static_cast<std::size_t>(k)]);
  }
};

/// The part of the objective that the code of one track changes.
double code_cost(const TrackLasso& lasso, const LassoSolution& code) {
  return 0.5 * code.s.dot(code.gram_s) - lasso.products.dot(code.s) + DictionaryConfig::sparsity * code.s.sum();
}

}  // namespace

CodingProblem::CodingProblem(std::span<const GridVector> vectors, const Grid& grid_, double gain_cells_)
    : grid(grid_), gain_cells(gain_cells_) {
  std::set<CellKey> keys;
  for (const GridVector& vector : vectors) keys.insert(vector.path.begin(), vector.path.end());
  cells.assign(keys.begin(), keys.end());
  visits.resize(cells.size());
  tracks.resize(vectors.size());
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    for (std::size_t c = 0; c < vectors[i].path.size(); ++c) {
      const Vector2& direction = vectors[i].directions[c];
      if (direction.isZero()) continue;
      const auto cell = std::lower_bound(cells.begin(), cells.end(), vectors[i].path[c]) - cells.begin();
      const Arrow value(direction.x(), direction.y(), 1.0);
      tracks[i].push_back({static_cast<int>(cell), value});
      visits[static_cast<std::size_t>(cell)].push_back({static_cast<int>(i), value});
      energy += 0.5 * value.squaredNorm();
    }
  }
}

CodingState with_new_codes(const CodingProblem& problem, CodingState state) {
  const Overlap overlap = overlap_of(problem, state);
  Products products(state.primitives.size());
  state.objective = problem.energy;
  for (std::size_t i = 0; i < problem.tracks.size(); ++i) {
    const TrackLasso lasso = track_lasso(problem, state, overlap, i, products);
    const LassoSolution code = nonnegative_lasso(TrackGram{overlap, lasso.primitives}, lasso.products,
                                                 DictionaryConfig::sparsity, lasso.start);
    state.codes[i] = code_of(lasso, code.s);
    state.objective += code_cost(lasso, code);
  }
  return state;
}

CodingState with_new_primitives(const CodingProblem& problem, CodingState state) {
  const auto count = static_cast<Eigen::Index>(state.primitives.size());
  Eigen::MatrixXd code_gram = Eigen::MatrixXd::Zero(count, count);  // A = S S'
  Eigen::MatrixXd use = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(problem.tracks.size()), count);
  for (std::size_t i = 0; i < state.codes.size(); ++i) {
    for (const Coefficient& a : state.codes[i]) {
      use(static_cast<Eigen::Index>(i), a.primitive) = a.value;
      for (const Coefficient& b : state.codes[i]) code_gram(b.primitive, a.primitive) += a.value * b.value;
    }
  }
  const Overlap overlap =
      primitives_at(problem, state);  // points into `state`: later primitives use the new earlier ones
  for (Eigen::Index k = 0; k < count; ++k) {
    const double self = code_gram(k, k);
    if (self <= 1e-8) continue;
    for (CellArrow& arrow : state.primitives[static_cast<std::size_t>(k)]) {
      Arrow pull = Arrow::Zero();
      for (const CellArrow& visit : problem.visits[static_cast<std::size_t>(arrow.cell)])
        pull += use(visit.cell, k) * visit.value;
      for (const Overlap::Entry& other : overlap.at(arrow.cell)) pull -= code_gram(other.primitive, k) * *other.arrow;
      arrow.value = project_arrow(arrow.value + pull / self);
    }
  }
  return state;
}

std::vector<CellArrow> residual(const CodingProblem& problem, const CodingState& state, std::size_t track) {
  std::vector<CellArrow> rest = problem.tracks[track];
  for (const Coefficient& used : state.codes[track]) {
    const std::vector<CellArrow>& primitive = state.primitives[static_cast<std::size_t>(used.primitive)];
    for (CellArrow& left : rest) {
      const auto own = std::ranges::lower_bound(primitive, left.cell, {}, &CellArrow::cell);
      if (own != primitive.end() && own->cell == left.cell) left.value -= used.value * own->value;
    }
  }
  return rest;
}

Overlap overlap_of(const CodingProblem& problem, const CodingState& state) {
  Overlap overlap = primitives_at(problem, state);
  overlap.gram = gram_of(problem, state, overlap);
  return overlap;
}

Removal removal_of(const CodingProblem& problem, const CodingState& state, const Overlap& overlap, int primitive) {
  Removal removal;
  Products products(state.primitives.size());
  for (std::size_t i = 0; i < state.codes.size(); ++i) {
    if (std::ranges::find(state.codes[i], primitive, &Coefficient::primitive) == state.codes[i].end()) continue;
    TrackLasso lasso = track_lasso(problem, state, overlap, i, products);
    const LassoSolution present{lasso.start, gram_times(TrackGram{overlap, lasso.primitives}, lasso.start)};
    const auto index =
        std::lower_bound(lasso.primitives.begin(), lasso.primitives.end(), primitive) - lasso.primitives.begin();
    const double before = code_cost(lasso, present);
    lasso.products(index) = 0.0;
    lasso.start(index) = 0.0;
    const LassoSolution code = nonnegative_lasso(TrackGram{overlap, lasso.primitives, index}, lasso.products,
                                                 DictionaryConfig::sparsity, lasso.start);
    removal.cost += code_cost(lasso, code) - before;
    removal.codes.emplace_back(i, code_of(lasso, code.s));
  }
  return removal;
}

CodingState without(const CodingState& state, const std::vector<bool>& drop) {
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
