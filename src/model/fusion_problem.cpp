#include "sila/model/fusion_problem.hpp"

#include <cmath>
#include <set>

#include "core/concatenate.hpp"

namespace sila {
namespace {

[[noreturn]] void reject_problem(const auto&... parts) {
  throw invalid_argument("fusion problem: ", parts...);
}

bool exists(const FusionProblem& problem, int primitive) {
  return primitive >= 0 && primitive < problem.primitives();
}

void check_similarities(const FusionProblem& problem) {
  std::set<std::pair<int, int>> seen;
  for (const Similarity& pair : problem.similarities) {
    const auto reject_pair = [&](const char* what) {
      reject_problem("similarity of primitives ", pair.first, " and ", pair.second, " (counted from 0) = ", pair.value,
                     ", ", what);
    };
    if (!exists(problem, pair.first) || !exists(problem, pair.second))
      reject_pair("of a primitive that does not exist");
    if (pair.first >= pair.second) reject_pair("first must be below second");
    if (!(std::abs(pair.value) <= 1.0)) reject_pair("it must be in [-1, 1]");
    if (!seen.emplace(pair.first, pair.second).second) reject_pair("it stands twice");
  }
}

void check_transitions(const FusionProblem& problem) {
  std::set<std::pair<int, int>> seen;
  for (const TransitionCount& edge : problem.transitions) {
    const auto reject_edge = [&](const char* what) {
      reject_problem("transition ", edge.from, " -> ", edge.to, " (counted from 0) with count ", edge.count, ", ",
                     what);
    };
    if (!exists(problem, edge.from) || !exists(problem, edge.to)) reject_edge("of a primitive that does not exist");
    if ((edge.from < problem.previous_primitives) != (edge.to < problem.previous_primitives))
      reject_edge("it must stay within one model");
    if (!(edge.count > 0.0) || !std::isfinite(edge.count)) reject_edge("the count must be positive");
    if (!seen.emplace(edge.from, edge.to).second) reject_edge("it stands twice");
  }
}

}  // namespace

void validate(const FusionProblem& problem) {
  if (!(problem.similarity_threshold > 0.0) || !std::isfinite(problem.similarity_threshold))
    reject_problem("similarity_threshold = ", problem.similarity_threshold, ", it must be positive");
  if (problem.previous_primitives < 0)
    reject_problem("previous_primitives = ", problem.previous_primitives, " is negative");
  if (problem.incoming_primitives < 0)
    reject_problem("incoming_primitives = ", problem.incoming_primitives, " is negative");
  check_similarities(problem);
  check_transitions(problem);
}

const char* describe(FusionReason reason) {
  constexpr const char* names[] = {"one-to-one", "case 1", "case 2", "case 3", "case 3, stronger pair", "apart"};
  return names[static_cast<std::size_t>(reason)];
}

}  // namespace sila
