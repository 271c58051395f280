#include "sila/fuse/fuse.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>

#include "core/concatenate.hpp"
#include "core/indices.hpp"
#include "fuse/steps.hpp"
#include "model/same_settings.hpp"

namespace sila {
namespace {

void require_compatible(const std::string& function, const Model& previous, const Increment& incoming) {
  if (!previous.empty() && !incoming.model.empty()) require_same_settings(function, previous, incoming.model);
  if (!previous.transitions.empty() && !incoming.model.transitions.empty() &&
      previous.transitions.front().field.independent() != incoming.model.transitions.front().field.independent()) {
    throw invalid_argument(
        function, ": learn.field.outputs is shared in one model and independent in the other, they must be equal");
  }
  const std::size_t transitions = incoming.model.transitions.size();
  if (!incoming.samples.empty() && incoming.samples.size() != transitions)
    throw invalid_argument(function, ": incoming.samples = ", incoming.samples.size(),
                           " sets, there must be none or one for each of the ", transitions, " transitions");
  for (const GpData& samples : incoming.samples) {
    const Eigen::Index points = samples.inputs.cols();
    if (points == 0 && samples.outputs.rows() == 0) continue;
    if (samples.inputs.rows() == 2 && samples.outputs.rows() == points && samples.outputs.cols() == 2) continue;
    throw invalid_argument(function, ": incoming.samples has positions ", samples.inputs.rows(), " x ", points,
                           " and velocities ", samples.outputs.rows(), " x ", samples.outputs.cols(),
                           ", they must be 2 x n and n x 2");
  }
}

/// Line 4 of Alg. 1: both models side by side, reduced to the numbers that the re-indexing needs.
FusionProblem joint_problem(const Model& previous, const Model& incoming) {
  FusionProblem problem;
  problem.previous_primitives = static_cast<int>(previous.primitives.size());
  problem.incoming_primitives = static_cast<int>(incoming.primitives.size());
  const int shift = problem.previous_primitives;
  for (const Transition& edge : previous.transitions) problem.transitions.push_back({edge.from, edge.to, edge.count});
  for (const Transition& edge : incoming.transitions)
    problem.transitions.push_back({edge.from + shift, edge.to + shift, edge.count});
  return problem;
}

/// The counts of all joint transitions, in their order in `joint_problem`, by the sites of the fused model.
std::vector<std::vector<SiteCount>> all_counts(const Model& previous, const Model& incoming,
                                               const JoinedSites& joined) {
  std::vector<std::vector<SiteCount>> counts;
  for (const Transition& transition : previous.transitions) counts.push_back(transition.sites);
  for (const Transition& transition : incoming.transitions) {
    std::vector<SiteCount>& parts = counts.emplace_back();
    for (SiteCount part : transition.sites) {
      const auto site = static_cast<std::size_t>(joined.of_second.at(static_cast<std::size_t>(part.site)));
      if (site < previous.sites.size()) part.last_episode += previous.sites[site].episodes;
      part.site = static_cast<int>(site);
      add_count(parts, part);
    }
  }
  return counts;
}

/// The edges of the similarity graph, and the similarities within a model that case 2 needs.
std::vector<Similarity> similarities_of(const Model& previous, const Model& incoming, const FuseConfig& config) {
  SimilarityEdges graph = similarity_graph(previous, incoming, config.similarity_threshold);
  if (config.sites == SiteSharing::apart) keep_sites_apart(graph, previous, incoming);
  SimilarityEdges all = leaf_similarities(graph, previous, incoming);
  all.insert(all.end(), graph.begin(), graph.end());
  return all;
}

/// Lower bound of the number of different tracks that showed a primitive or transition made of several of both models:
/// the largest support on each side. The models have no track in common, but one track may have shown several parts of
/// one model.
struct Support {
  int previous = 0;
  int incoming = 0;
  int sum() const { return previous + incoming; }
};

/// D'': the kept primitives, the first of each tuple of the fusion set as the mean of the tuple.
std::vector<MotionPrimitive> fused_primitives(const Model& previous, const Model& incoming, const FusionPlan& plan,
                                              PrimitiveMean mean) {
  std::map<int, const std::vector<int>*> tuples;
  for (const std::vector<int>& tuple : plan.fusion_set) tuples[tuple.front()] = &tuple;
  std::vector<MotionPrimitive> result;
  for (const int kept : plan.kept) {
    const auto tuple = tuples.find(kept);
    if (tuple == tuples.end()) {
      result.push_back(primitive_at(previous, incoming, kept));
      continue;
    }
    std::vector<const MotionPrimitive*> members;
    Support support;
    for (const int member : *tuple->second) {
      members.push_back(&primitive_at(previous, incoming, member));
      int& side = member < static_cast<int>(previous.primitives.size()) ? support.previous : support.incoming;
      side = std::max(side, members.back()->support);
    }
    result.push_back(mean_primitive(members, mean));
    result.back().support = support.sum();
  }
  return result;
}

/// The count of each group by site: that of its sources, and the credit for splits.
std::vector<std::vector<SiteCount>> counts_of_groups(const FusionProblem& problem, const FusionPlan& plan,
                                                     const std::vector<std::vector<SiteCount>>& counts,
                                                     bool split_credit) {
  std::map<std::pair<int, int>, std::size_t> joint;
  for (std::size_t t = 0; t < problem.transitions.size(); ++t)
    joint[{problem.transitions[t].from, problem.transitions[t].to}] = t;
  std::vector<std::vector<SiteCount>> sums(plan.groups.size());
  for (std::size_t g = 0; g < plan.groups.size(); ++g) {
    const TransitionGroup& group = plan.groups[g];
    for (const auto& source : group.sources) {
      for (const SiteCount& part : counts[joint.at(source)]) add_count(sums[g], part);
    }
    for (const PrimitiveSplit& split : plan.splits) {
      if (!split_credit || split.first != group.from || split.second != group.to) continue;
      for (const std::size_t t : flow_through(split.primitive, problem.transitions)) {
        for (const SiteCount& part : counts[t]) add_count(sums[g], part);
      }
    }
  }
  return sums;
}

int support_of(const TransitionGroup& group, const Model& previous, const Model& incoming) {
  Support support;
  for (const std::pair<int, int>& edge : group.sources) {
    const auto [model, index] = source_of(edge, previous, incoming);
    int& side = model == &previous ? support.previous : support.incoming;
    side = std::max(side, model->transitions[index].support);
  }
  return support.sum();
}

/// R'': every group becomes a transition; the groups are independent of each other and are fused in parallel.
/// `counts`: of each group by site.
std::vector<Transition> fused_transitions(const Model& previous, const Increment& incoming, const FusionPlan& plan,
                                          std::vector<std::vector<SiteCount>> counts, const GpConfig& config) {
  const std::vector<int> new_index = inverse_of(plan.kept, plan.in.size());
  std::vector<Transition> result(plan.groups.size());
  tbb::parallel_for(std::size_t{0}, plan.groups.size(), [&](std::size_t g) {
    const TransitionGroup& group = plan.groups[g];
    Transition& fused = result[g];
    fused.from = new_index[static_cast<std::size_t>(group.from)];
    fused.to = new_index[static_cast<std::size_t>(group.to)];
    fused.count = group.count;
    fused.field = fuse_fields(sources_of(group, previous, incoming), config);
    fused.sites = std::move(counts[g]);
    fused.support = support_of(group, previous, incoming.model);
  });
  return result;
}

/// Alg. 2: the model that a plan describes.
FuseResult carry_out(FusionProblem problem, FusionPlan plan, const Model& previous, const Increment& incoming,
                     const FuseConfig& config) {
  JoinedSites joined = join_sites(previous.sites, incoming.model.sites);
  std::vector<std::vector<SiteCount>> counts =
      counts_of_groups(problem, plan, all_counts(previous, incoming.model, joined), config.split_credit);
  Model model;
  model.settings = previous.empty() ? incoming.model.settings : previous.settings;
  model.primitives = fused_primitives(previous, incoming.model, plan, config.mean);
  model.transitions = fused_transitions(previous, incoming, plan, std::move(counts), config.gp);
  model.sites = std::move(joined.sites);
  model.sharing = config.sites;
  model.episodes = previous.episodes + incoming.model.episodes;
  model.tracks = previous.tracks + incoming.model.tracks;
  return {std::move(model), std::move(problem), std::move(plan)};
}

}  // namespace

void validate(const FuseConfig& config) {
  validate_fields("fuse", config);
  validate(config.gp);
}

FuseResult fuse(const Model& previous, const Increment& incoming, const FuseConfig& config) {
  validate(config);
  require_compatible("fuse", previous, incoming);
  require_separable("fuse", previous, config.sites);
  require_separable("fuse", incoming.model, config.sites);
  FusionProblem problem = joint_problem(previous, incoming.model);  // M^(n), line 4
  problem.similarity_threshold = config.similarity_threshold;
  problem.similarities = similarities_of(previous, incoming.model, config);           // Eq. 1, 2
  FusionPlan plan = plan_fusion(problem, config);                                     // cases 1, 2, 3
  return carry_out(std::move(problem), std::move(plan), previous, incoming, config);  // Alg. 2
}

FuseResult accumulate(const Model& previous, const Increment& incoming) {
  require_compatible("accumulate", previous, incoming);
  FusionProblem problem = joint_problem(previous, incoming.model);  // no similarities: nothing can match
  FusionPlan plan = plan_fusion(problem);
  FuseConfig config;
  if (previous.sharing == SiteSharing::shared || incoming.model.sharing == SiteSharing::shared)
    config.sites = SiteSharing::shared;
  return carry_out(std::move(problem), std::move(plan), previous, incoming, config);
}

}  // namespace sila
