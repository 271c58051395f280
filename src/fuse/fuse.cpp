#include "sila/fuse/fuse.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <stdexcept>

#include "fuse_fields.hpp"
#include "sila/fuse/mean.hpp"
#include "sila/fuse/reindex.hpp"
#include "sila/fuse/similarity.hpp"

namespace sila {
namespace {

std::string describe(const Conventions& conventions) {
  const Grid& grid = conventions.grid;
  std::ostringstream text;
  text << "{cell " << grid.cell << ", origin (" << grid.origin.x() << ", " << grid.origin.y() << "), tile_cells "
       << grid.tile_cells << ", scaling "
       << (conventions.scaling == CurbScaling::mean_width ? "mean_width" : "strip_widths") << ", sample_interval_s "
       << conventions.sample_interval_s << ", reference_width_m " << conventions.reference_width_m
       << ", outlook_horizon_s " << conventions.outlook_horizon_s << ", outlook_knots " << conventions.outlook_knots
       << "}";
  return text.str();
}

void require_compatible(const std::string& function, const Model& previous, const Increment& incoming) {
  const Conventions& ours = previous.conventions;
  const Conventions& theirs = incoming.model.conventions;
  if (!previous.empty() && !incoming.model.empty() && !(ours == theirs)) {
    throw std::invalid_argument(function + ": conventions of previous = " + describe(ours) +
                                ", those of incoming = " + describe(theirs) + ", they must be equal");
  }
  const std::size_t transitions = incoming.model.transitions.size();
  if (!incoming.samples.empty() && incoming.samples.size() != transitions) {
    throw std::invalid_argument(function + ": incoming.samples = " + std::to_string(incoming.samples.size()) +
                                " sets, there must be none or one for each of the " + std::to_string(transitions) +
                                " transitions");
  }
  for (const TransitionSamples& samples : incoming.samples) {
    const Eigen::Index points = samples.positions.cols();
    if (points == 0 && samples.velocities.rows() == 0) continue;
    if (samples.positions.rows() == 2 && samples.velocities.rows() == points && samples.velocities.cols() == 2)
      continue;
    std::ostringstream text;
    text << function << ": incoming.samples has positions " << samples.positions.rows() << " x " << points
         << " and velocities " << samples.velocities.rows() << " x " << samples.velocities.cols()
         << ", they must be 2 x n and n x 2";
    throw std::invalid_argument(text.str());
  }
}

/// Line 4 of Alg. 1: both models side by side, as far as the re-indexing looks at them.
FusionProblem joint_problem(const Model& previous, const Model& incoming) {
  FusionProblem problem;
  problem.previous_primitives = static_cast<int>(previous.primitives.size());
  problem.incoming_primitives = static_cast<int>(incoming.primitives.size());
  const int shift = problem.previous_primitives;
  for (const Transition& edge : previous.transitions) problem.transitions.push_back({edge.from, edge.to, edge.count});
  for (const Transition& edge : incoming.transitions) {
    problem.transitions.push_back({edge.from + shift, edge.to + shift, edge.count});
  }
  return problem;
}

/// The edges of the similarity graph and what case 2 may ask for.
std::vector<Similarity> similarities_of(const Model& previous, const Model& incoming, double threshold) {
  const SimilarityGraph graph = similarity_graph(previous, incoming, threshold);
  std::vector<Similarity> all = leaf_similarities(graph, previous, incoming);
  all.insert(all.end(), graph.edges.begin(), graph.edges.end());
  return all;
}

const MotionPrimitive& primitive_at(const Model& previous, const Model& incoming, int joint) {
  const std::size_t index = static_cast<std::size_t>(joint);
  const std::size_t shift = previous.primitives.size();
  return index < shift ? previous.primitives[index] : incoming.primitives[index - shift];
}

/// How many different tracks support what is made of parts of both models, at the least: the models have no track in
/// common, but a track may have shown several parts of one model.
struct Support {
  int previous = 0;
  int incoming = 0;
  int sum() const { return previous + incoming; }
};

/// D'': the kept primitives, the first of each tuple of the fusion set as the mean of the tuple.
std::vector<MotionPrimitive> fused_primitives(const Model& previous, const Model& incoming, const FusionPlan& plan,
                                              const FuseConfig& config) {
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
    result.push_back(mean_primitive(members, config.mean, config.drop_below));
    result.back().support = support.sum();
  }
  return result;
}

const Transition& transition_at(const Model& model, std::pair<int, int> edge) {
  return *std::lower_bound(model.transitions.begin(), model.transitions.end(), edge,
                           [](const Transition& transition, const std::pair<int, int>& wanted) {
                             return std::pair(transition.from, transition.to) < wanted;
                           });
}

detail::FieldSources sources_of(const TransitionGroup& group, const Model& previous, const Increment& incoming) {
  const int shift = static_cast<int>(previous.primitives.size());
  detail::FieldSources sources;
  for (const auto& [from, to] : group.sources) {
    if (from < shift) {
      sources.stored.push_back(&transition_at(previous, {from, to}));
      continue;
    }
    const Transition& transition = transition_at(incoming.model, {from - shift, to - shift});
    const auto index = static_cast<std::size_t>(&transition - incoming.model.transitions.data());
    const bool has_samples = !incoming.samples.empty() && incoming.samples[index].positions.cols() > 0;
    (has_samples ? sources.fresh : sources.stored).push_back(&transition);
    if (has_samples) sources.samples.push_back(&incoming.samples[index]);
  }
  return sources;
}

/// The episode of the fused model in which somebody last walked any of the transitions that become one.
int last_episode_of(const TransitionGroup& group, const Model& previous, const Model& incoming) {
  const int shift = static_cast<int>(previous.primitives.size());
  int last = 0;
  for (const auto& [from, to] : group.sources) {
    last = std::max(last, from < shift
                              ? transition_at(previous, {from, to}).last_episode
                              : previous.episodes + transition_at(incoming, {from - shift, to - shift}).last_episode);
  }
  return last;
}

int support_of(const TransitionGroup& group, const Model& previous, const Model& incoming) {
  const int shift = static_cast<int>(previous.primitives.size());
  Support support;
  for (const auto& [from, to] : group.sources) {
    if (from < shift)
      support.previous = std::max(support.previous, transition_at(previous, {from, to}).support);
    else
      support.incoming = std::max(support.incoming, transition_at(incoming, {from - shift, to - shift}).support);
  }
  return support.sum();
}

/// R'': every group becomes a transition; the groups are independent of each other and are fused in parallel.
std::vector<Transition> fused_transitions(const std::vector<detail::FieldSources>& sources, const FusionPlan& plan,
                                          const GpConfig& config, const GpConfig& outlook_config) {
  std::vector<int> place(plan.in.size(), -1);  // compact indices, at the very end
  for (std::size_t k = 0; k < plan.kept.size(); ++k)
    place[static_cast<std::size_t>(plan.kept[k])] = static_cast<int>(k);
  std::vector<Transition> result(plan.groups.size());
  tbb::parallel_for(std::size_t{0}, plan.groups.size(), [&](std::size_t g) {
    const TransitionGroup& group = plan.groups[g];
    result[g] = {place[static_cast<std::size_t>(group.from)], place[static_cast<std::size_t>(group.to)], group.count,
                 detail::fuse_fields(sources[g], config), detail::fuse_outlooks(sources[g], outlook_config)};
  });
  return result;
}

void count_decision(FusionReason reason, FuseReport& report) {
  switch (reason) {
    case FusionReason::one_to_one:
      ++report.one_to_one;
      break;
    case FusionReason::case_1:
      ++report.case_1;
      break;
    case FusionReason::case_2:
      ++report.case_2;
      break;
    case FusionReason::case_3:
    case FusionReason::case_3_stronger:
      ++report.case_3;
      break;
    case FusionReason::apart:
      ++report.apart;
      break;
  }
}

FuseReport report_of(const FusionPlan& plan, const std::vector<detail::FieldSources>& sources) {
  FuseReport report;
  for (const FusionComponent& component : plan.components) {
    report.relaxed += static_cast<int>(component.relaxed.size());
    for (const FusionDecision& decision : component.decisions) count_decision(decision.reason, report);
  }
  for (const detail::FieldSources& group : sources) {
    const detail::FieldOrigin origin = origin_of(group);
    report.copied += origin == detail::FieldOrigin::copied;
    report.refitted += origin == detail::FieldOrigin::refitted;
    report.fused += origin == detail::FieldOrigin::fused;
  }
  for (const TransitionGroup& group : plan.groups) report.split_credit += group.credit;
  return report;
}

/// Alg. 2: the model that a plan describes.
Fused carry_out(FusionProblem problem, FusionPlan plan, const Model& previous, const Increment& incoming,
                const FuseConfig& config, const OutlookConfig& outlook) {
  std::vector<detail::FieldSources> sources;
  for (const TransitionGroup& group : plan.groups) sources.push_back(sources_of(group, previous, incoming));
  Model model;
  model.conventions = previous.empty() ? incoming.model.conventions : previous.conventions;
  model.primitives = fused_primitives(previous, incoming.model, plan, config);
  model.transitions = fused_transitions(sources, plan, config.gp, outlook_gp_config(outlook));
  for (std::size_t g = 0; g < plan.groups.size(); ++g) {
    model.transitions[g].last_episode = last_episode_of(plan.groups[g], previous, incoming.model);
    model.transitions[g].support = support_of(plan.groups[g], previous, incoming.model);
  }
  model.lessons = previous.lessons.empty() ? incoming.model.lessons : previous.lessons;
  model.gait = incoming.gait.inputs.cols() > 0 ? learn_gait(previous.gait, incoming.gait, outlook)
                                               : fuse_gaits(previous.gait, incoming.model.gait, outlook);
  model.places = with_places(previous.places, incoming.model.places);
  model.episodes = previous.episodes + incoming.model.episodes;
  model.tracks = previous.tracks + incoming.model.tracks;
  const FuseReport report = report_of(plan, sources);
  return {std::move(model), std::move(problem), std::move(plan), report};
}

}  // namespace

void validate(const FuseConfig& config) {
  validate_fields("fuse", config);
}

Fused fuse(const Model& previous, const Increment& incoming, const FuseConfig& config, const OutlookConfig& outlook) {
  validate(config);
  require_compatible("fuse", previous, incoming);
  FusionProblem problem = joint_problem(previous, incoming.model);  // M^(n), line 4
  problem.similarity_threshold = config.similarity_threshold;
  problem.similarities = similarities_of(previous, incoming.model, config.similarity_threshold);  // Eq. 1, 2
  FusionPlan plan = plan_fusion(problem, config);                                                 // cases 1, 2, 3
  return carry_out(std::move(problem), std::move(plan), previous, incoming, config, outlook);     // Alg. 2
}

Fused accumulate(const Model& previous, const Increment& incoming) {
  require_compatible("accumulate", previous, incoming);
  FusionProblem problem = joint_problem(previous, incoming.model);  // no similarities: nothing can match
  FusionPlan plan = plan_fusion(problem);
  return carry_out(std::move(problem), std::move(plan), previous, incoming, FuseConfig{}, OutlookConfig{});
}

}  // namespace sila
