#include "sila/evaluate/compare.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "fuse/steps.hpp"
#include "gp/flow_posterior.hpp"
#include "model/same_settings.hpp"
#include "sila/core/sampling.hpp"
#include "sila/evaluate/evaluate.hpp"
#include "sila/model/packing.hpp"

namespace sila {
namespace {

constexpr double kStanding_mps = 0.2;

bool equal(const MotionPrimitive& a, const MotionPrimitive& b) {
  return std::ranges::equal(a.cells, b.cells, [](const CellVelocity& one, const CellVelocity& other) {
    return one.cell == other.cell && one.velocity == other.velocity;
  });
}

/// The primitives that may belong together: equal ones, then the most similar ones first.
SimilarityEdges candidates(const Model& a, const Model& b, double threshold) {
  SimilarityEdges edges = similarity_graph(a, b, threshold);
  if (a.sharing == SiteSharing::apart && b.sharing == SiteSharing::apart) keep_sites_apart(edges, a, b);
  const auto rest = std::stable_partition(edges.begin(), edges.end(), [&](const Similarity& edge) {
    return equal(primitive_at(a, b, edge.first), primitive_at(a, b, edge.second));
  });
  std::stable_sort(rest, edges.end(), [](const Similarity& x, const Similarity& y) { return x.value > y.value; });
  return edges;
}

bool same_content(const Model& a, std::size_t i, const Model& b, std::size_t j) {
  return a.transitions[i].count == b.transitions[j].count &&
         pack(a.transitions[i].field) == pack(b.transitions[j].field) &&
         pack(entry_of(a.refinement.residuals, i)) == pack(entry_of(b.refinement.residuals, j));
}

void compare_transitions(const Model& a, const Model& b, const std::vector<int>& partner_of,
                         ModelComparison& comparison) {
  std::map<std::pair<int, int>, std::size_t> there;
  for (std::size_t j = 0; j < b.transitions.size(); ++j) there[{b.transitions[j].from, b.transitions[j].to}] = j;
  for (std::size_t i = 0; i < a.transitions.size(); ++i) {
    const Transition& transition = a.transitions[i];
    const auto found = there.find(
        {partner_of[static_cast<std::size_t>(transition.from)], partner_of[static_cast<std::size_t>(transition.to)]});
    const std::pair here(transition.from, transition.to);
    if (found == there.end()) {
      comparison.transitions_of_a.push_back(here);
      continue;
    }
    if (same_content(a, i, b, found->second))
      ++comparison.same_transitions;
    else
      comparison.changed_transitions.push_back(
          {here, found->first, transition.count, b.transitions[found->second].count});
    there.erase(found);
  }
  for (const auto& [key, transition] : there) comparison.transitions_of_b.push_back(key);
}

/// A straight path that ends at this position with this velocity (curb coordinates).
CurbTrajectory straight_path(const Vector2& position, const Vector2& velocity, const CurbFrame& frame, double observe_s,
                             double interval_s) {
  CurbTrajectory path{"traced", frame, {}, {}, {}};
  const auto steps = std::max<long>(2, std::lround(observe_s / interval_s));
  for (long k = steps - 1; k >= 0; --k) {
    const double before_s = static_cast<double>(k) * interval_s;
    path.times_s.push_back(static_cast<double>(steps - 1) * interval_s - before_s);
    path.positions.emplace_back(position - before_s * velocity);
    path.velocities.push_back(velocity);
  }
  return path;
}

}  // namespace

ModelComparison compare(const Model& a, const Model& b, double similarity_threshold) {
  require_same_settings("compare", a, b);
  ModelComparison comparison;
  std::vector<int> partner_of(a.primitives.size(), -1);
  std::vector<bool> has_partner(b.primitives.size(), false);
  for (const Similarity& edge : candidates(a, b, similarity_threshold)) {
    int& partner = partner_of[static_cast<std::size_t>(edge.first)];
    const std::size_t other = static_cast<std::size_t>(edge.second) - a.primitives.size();
    if (partner >= 0 || has_partner[other]) continue;
    partner = static_cast<int>(other);
    has_partner[other] = true;
    if (equal(primitive_at(a, b, edge.first), b.primitives[other]))
      ++comparison.same_primitives;
    else
      comparison.changed_primitives.push_back({edge.first, partner, edge.value});
  }
  std::ranges::sort(comparison.changed_primitives, {}, &PrimitivePair::a);
  for (std::size_t i = 0; i < partner_of.size(); ++i) {
    if (partner_of[i] < 0) comparison.primitives_of_a.push_back(static_cast<int>(i));
  }
  for (std::size_t i = 0; i < has_partner.size(); ++i) {
    if (!has_partner[i]) comparison.primitives_of_b.push_back(static_cast<int>(i));
  }
  compare_transitions(a, b, partner_of, comparison);
  return comparison;
}

std::vector<CurbTrajectory> traced_paths(const Model& model, double observe_s, std::size_t most) {
  std::vector<CurbTrajectory> paths;
  for (const Transition& transition : model.transitions) {
    const CurbFrame& frame = model.sites.at(static_cast<std::size_t>(transition.sites.at(0).site)).frame;
    const FlowPosterior posterior(transition.field.gp, transition.field.second());
    const Eigen::MatrixXd& positions = transition.field.gp.pseudo_inputs;
    for (Eigen::Index m = 0; m < positions.cols(); ++m) {
      const Vector2 velocity = posterior.predict(positions.col(m)).mean;
      if (velocity_to_world(frame, velocity).norm() < kStanding_mps) continue;
      paths.push_back(straight_path(positions.col(m), velocity, frame, observe_s, model.settings.sample_interval_s));
    }
  }
  const std::size_t step = std::max<std::size_t>(1, (paths.size() + most - 1) / std::max<std::size_t>(1, most));
  for (std::size_t i = 0; i * step < paths.size(); ++i) std::swap(paths[i], paths[i * step]);
  paths.resize((paths.size() + step - 1) / step);
  return paths;
}

std::vector<HorizonDifference> compare_predictions(const Predictor& a, const Predictor& b,
                                                   std::span<const CurbTrajectory> observed) {
  if (observed.empty()) return {};
  if (a.config().horizon_s != b.config().horizon_s || a.interval_s() != b.interval_s())
    throw std::invalid_argument("compare_predictions: the predictors have different horizons, they must be equal");
  const std::vector<double> horizons_s = horizons_until(a.config().horizon_s);
  std::vector<std::vector<double>> distances_m(observed.size());
  tbb::parallel_for(std::size_t{0}, observed.size(), [&](std::size_t i) {
    const Prediction first = a.predict(observed[i]), second = b.predict(observed[i]);
    const std::size_t steps = first.times_s.size();
    const std::vector<Vector2> path_a = mean_path(first, steps), path_b = mean_path(second, steps);
    for (const double horizon_s : horizons_s) {
      const auto step = std::clamp(steps_in(horizon_s, a.interval_s()), 1, static_cast<int>(steps));
      const auto at = static_cast<std::size_t>(step - 1);
      distances_m[i].push_back((path_a[at] - path_b[at]).norm());
    }
  });
  std::vector<HorizonDifference> differences;
  for (std::size_t h = 0; h < horizons_s.size(); ++h) {
    HorizonDifference& difference = differences.emplace_back();
    difference.horizon_s = horizons_s[h];
    for (const std::vector<double>& of_path : distances_m) {
      difference.mean_m += of_path[h] / static_cast<double>(observed.size());
      difference.max_m = std::max(difference.max_m, of_path[h]);
    }
  }
  return differences;
}

}  // namespace sila
