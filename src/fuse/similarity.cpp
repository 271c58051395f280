#include <algorithm>
#include <cmath>
#include <map>

#include "core/concatenate.hpp"
#include "core/indices.hpp"
#include "fuse/steps.hpp"

namespace sila {
namespace {

double length(const MotionPrimitive& primitive) {
  double sum = 0.0;
  for (const CellVelocity& arrow : primitive.cells) sum += arrow.velocity.squaredNorm();
  return std::sqrt(sum);
}

double product(const MotionPrimitive& a, const MotionPrimitive& b) {
  double sum = 0.0;
  auto left = a.cells.begin();
  auto right = b.cells.begin();
  while (left != a.cells.end() && right != b.cells.end()) {
    if (left->cell < right->cell) {
      ++left;
    } else if (right->cell < left->cell) {
      ++right;
    } else {
      sum += (left++)->velocity.dot((right++)->velocity);
    }
  }
  return sum;
}

/// Rounding must not make a cosine of more than 1.
double cosine(double product, double length_a, double length_b) {
  const double lengths = length_a * length_b;
  return lengths > 0.0 ? std::clamp(product / lengths, -1.0, 1.0) : 0.0;
}

/// An arrow and the primitive that has it.
struct OwnedArrow {
  CellKey cell;
  std::size_t primitive = 0;
  Vector2 velocity;
};

/// The arrows of all primitives, sorted by cell.
std::vector<OwnedArrow> arrows_by_cell(const Model& model) {
  std::vector<OwnedArrow> arrows;
  for (std::size_t p = 0; p < model.primitives.size(); ++p) {
    for (const CellVelocity& arrow : model.primitives[p].cells) arrows.push_back({arrow.cell, p, arrow.velocity});
  }
  std::ranges::sort(arrows, {}, [](const OwnedArrow& arrow) { return std::pair(arrow.cell, arrow.primitive); });
  return arrows;
}

/// Products of one primitive with all that share a cell with it, in the order of cells as in `product`.
std::map<std::size_t, double> products_with(const std::vector<OwnedArrow>& arrows, const MotionPrimitive& primitive) {
  std::map<std::size_t, double> products;
  for (const CellVelocity& mine : primitive.cells) {
    auto theirs = std::ranges::lower_bound(arrows, mine.cell, {}, &OwnedArrow::cell);
    for (; theirs != arrows.end() && theirs->cell == mine.cell; ++theirs)
      products[theirs->primitive] += theirs->velocity.dot(mine.velocity);
  }
  return products;
}

/// Primitives with a common neighbour, each pair once.
std::vector<std::pair<int, int>> siblings(const SimilarityEdges& edges) {
  std::map<int, std::vector<int>> neighbours;
  for (const Similarity& edge : edges) {
    neighbours[edge.first].push_back(edge.second);
    neighbours[edge.second].push_back(edge.first);
  }
  std::vector<std::pair<int, int>> pairs;
  for (const auto& [centre, leaves] : neighbours) {
    for (std::size_t a = 0; a < leaves.size(); ++a) {
      for (std::size_t b = a + 1; b < leaves.size(); ++b) pairs.emplace_back(std::minmax(leaves[a], leaves[b]));
    }
  }
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

/// The sites of each primitive, by its transitions; all of its model if it has none. `index`: of each site in the list
/// that both models have in common.
std::vector<std::vector<SiteCount>> sites_of_primitives(const Model& model, const std::vector<int>& index) {
  std::vector<std::vector<SiteCount>> sites(model.primitives.size());
  for (const Transition& transition : model.transitions) {
    for (const int p : {transition.from, transition.to}) {
      for (const SiteCount& part : transition.sites)
        add_count(sites[static_cast<std::size_t>(p)], {index.at(static_cast<std::size_t>(part.site))});
    }
  }
  for (std::vector<SiteCount>& own : sites) {
    if (!own.empty()) continue;
    for (const int site : index) add_count(own, {site});
  }
  return sites;
}

}  // namespace

double similarity(const MotionPrimitive& a, const MotionPrimitive& b) {
  return cosine(product(a, b), length(a), length(b));
}

SimilarityEdges sorted(SimilarityEdges edges) {
  std::ranges::sort(edges, {}, [](const Similarity& edge) { return std::pair(edge.first, edge.second); });
  return edges;
}

const MotionPrimitive& primitive_at(const Model& previous, const Model& incoming, int joint) {
  const std::size_t index = static_cast<std::size_t>(joint);
  const std::size_t shift = previous.primitives.size();
  return index < shift ? previous.primitives[index] : incoming.primitives[index - shift];
}

SimilarityEdges similarity_graph(const Model& previous, const Model& incoming, double threshold) {
  if (!(threshold > 0.0)) throw invalid_argument("similarity_graph: threshold = ", threshold, ", it must be positive");
  const int shift = static_cast<int>(previous.primitives.size());
  SimilarityEdges edges;
  const std::vector<OwnedArrow> arrows = arrows_by_cell(previous);
  std::vector<double> lengths;
  for (const MotionPrimitive& primitive : previous.primitives) lengths.push_back(length(primitive));
  for (std::size_t j = 0; j < incoming.primitives.size(); ++j) {
    const double own_length = length(incoming.primitives[j]);
    for (const auto& [i, sum] : products_with(arrows, incoming.primitives[j])) {
      const double value = cosine(sum, lengths[i], own_length);
      if (value < threshold - kSimilaritySlack) continue;
      edges.push_back({static_cast<int>(i), shift + static_cast<int>(j), value});
    }
  }
  return sorted(std::move(edges));
}

void keep_sites_apart(SimilarityEdges& graph, const Model& previous, const Model& incoming) {
  const JoinedSites joined = join_sites(previous.sites, incoming.sites);
  if (joined.sites.size() < 2) return;
  const auto first = sites_of_primitives(previous, indices<int>(previous.sites.size()));
  const auto second = sites_of_primitives(incoming, joined.of_second);
  std::erase_if(graph, [&](const Similarity& edge) {
    return !share_a_site(first[static_cast<std::size_t>(edge.first)],
                         second[static_cast<std::size_t>(edge.second) - first.size()]);
  });
}

SimilarityEdges leaf_similarities(const SimilarityEdges& graph, const Model& previous, const Model& incoming) {
  SimilarityEdges result;
  for (const auto& [a, b] : siblings(graph)) {
    const double value = similarity(primitive_at(previous, incoming, a), primitive_at(previous, incoming, b));
    if (value != 0.0) result.push_back({a, b, value});
  }
  return result;
}

MotionPrimitive mean_primitive(std::span<const MotionPrimitive* const> members, PrimitiveMean mean) {
  std::map<CellKey, Vector2> sums;
  double total = 0.0;
  MotionPrimitive result{{}, 0.0};
  for (const MotionPrimitive* member : members) {
    const double share = mean == PrimitiveMean::count ? member->weight : 1.0;
    for (const CellVelocity& arrow : member->cells)
      sums.try_emplace(arrow.cell, Vector2::Zero()).first->second += share * arrow.velocity;
    total += share;
    result.weight += member->weight;
  }
  double longest = 0.0;
  for (auto& [cell, sum] : sums) {
    sum /= total;
    longest = std::max(longest, sum.norm());
  }
  if (!(longest > 0.0)) throw invalid_argument("mean_primitive: members = none, or they cancel out in every cell");
  for (const auto& [cell, sum] : sums) {
    if (sum.norm() >= std::min(FuseConfig::drop_below, longest) && !sum.isZero(0.0))
      result.cells.push_back({cell, sum});
  }
  return result;
}

}  // namespace sila
