#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sila/model/fusion_problem.hpp"

namespace sila {

/// A worked example of a fusion, read from a JSON file whose indices are 1-based (docs/fuse.md describes the keys).
struct FusionCase {
  std::string name;
  std::string note;
  FusionProblem problem;  ///< 0-based
  FusionRules rules;
  nlohmann::json expect;  ///< as in the file, lists that are sets sorted
};

/// Throws: FormatError if the file cannot be read, is not JSON, lacks a key, or has an unknown key in `options` or
/// `expect`.
FusionCase read_fusion_case(const std::string& path);

/// The plan in the keys of `expect`, 1-based.
nlohmann::ordered_json to_case_json(const FusionPlan& plan);

/// The differences between a plan and the expectation of a case, one line for each key; empty if the plan gives exactly
/// what was expected.
std::vector<std::string> differences(const nlohmann::json& expect, const FusionPlan& plan);

/// A fusion that took place, as a case file (it can be run as one) with the reason of every component under `reasons`.
nlohmann::ordered_json explain_fusion(const std::string& name, const FusionProblem& problem, const FusionRules& rules,
                                      const FusionPlan& plan);

}  // namespace sila
