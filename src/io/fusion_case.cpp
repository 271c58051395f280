#include <algorithm>
#include <cmath>
#include <iterator>

#include "json_file.hpp"
#include "sila/core/errors.hpp"
#include "sila/io/reports.hpp"

namespace sila {
namespace {

using Json = nlohmann::json;
using nlohmann::ordered_json;

/// The options of a case file and what they set.
template <class Rules, class Visitor>
void options(Rules& rules, Visitor&& visit) {
  visit("strict_relax", rules.strict_relax);
  visit("both_directions", rules.both_directions);
  visit("split_credit", rules.split_credit);
  visit("literal_self_transitions", rules.literal_self_transitions);
  visit("case_3_fuses_stronger", rules.case_3_fuses_stronger);
}

/// A list of [index, index, number], indices 1-based in the file.
template <class Entry>
std::vector<Entry> triples(const JsonFields& file, const char* key) {
  const char* const expected = "a list of [primitive, primitive, number]";
  const auto is_whole = [](double index) { return std::trunc(index) == index && std::abs(index) <= 1e9; };
  std::vector<Entry> entries;
  for (const std::vector<double>& row : file.rows(key, 3, expected)) {
    if (!is_whole(row[0]) || !is_whole(row[1])) file.reject(key, expected);
    entries.push_back({static_cast<int>(row[0]) - 1, static_cast<int>(row[1]) - 1, row[2]});
  }
  return entries;
}

FusionProblem read_problem(const JsonFields& file) {
  FusionProblem problem;
  problem.similarity_threshold = file.number("similarity_threshold");
  problem.previous_primitives = file.whole("previous_primitives");
  problem.incoming_primitives = file.whole("incoming_primitives");
  problem.similarities = triples<Similarity>(file, "similarity");
  for (Similarity& pair : problem.similarities) {
    if (pair.first > pair.second) std::swap(pair.first, pair.second);
  }
  problem.transitions = triples<TransitionCount>(file, "transitions");
  validate(problem);
  return problem;
}

FusionRules read_rules(const JsonFields& file, const Json& content) {
  FusionRules rules;
  if (!file.has("options")) return rules;
  const JsonFields given = file.object("options");
  std::size_t known = 0;
  std::string names;
  options(rules, [&](const char* name, bool& option) {
    names += (names.empty() ? "" : ", ") + std::string(name);
    option = given.flag_or(name, option);
    known += given.has(name) ? 1U : 0U;
  });
  if (known != content.at("options").size()) file.reject("options", "an object of " + names);
  return rules;
}

/// Lists that are sets, and the sources within a group, in one order, so that a file may list them in any.
Json canonical(Json result) {
  for (const char* key : {"fusion_set", "splits", "kept", "transitions", "groups"}) {
    if (!result.contains(key) || !result[key].is_array()) continue;
    for (Json& entry : result[key]) {
      if (std::string(key) == "fusion_set" && entry.is_array()) std::sort(entry.begin(), entry.end());
      const bool has_sources =
          std::string(key) == "groups" && entry.is_array() && entry.size() == 3 && entry[2].is_array();
      if (has_sources) std::sort(entry[2].begin(), entry[2].end());
    }
    std::sort(result[key].begin(), result[key].end());
  }
  return result;
}

Json read_expect(const JsonFields& file, const Json& content) {
  constexpr const char* expected = "an object of in, out, fusion_set, splits, kept, transitions, groups or model_size";
  if (!file.has("expect") || !content.at("expect").is_object() || content.at("expect").empty())
    file.reject("expect", expected);
  const ordered_json known = to_case_json(FusionPlan{});
  for (const auto& [key, value] : content.at("expect").items()) {
    if (!known.contains(key)) file.reject("expect", expected);
  }
  return canonical(content.at("expect"));
}

/// Counts are whole numbers unless a file says otherwise.
Json count_json(double count) {
  if (count == std::floor(count) && std::abs(count) < 1e15) return static_cast<long long>(count);
  return count;
}

Json one_based(const std::vector<int>& indices) {
  Json list = Json::array();
  for (const int index : indices) list.push_back(index + 1);
  return list;
}

Json edges_json(const std::vector<Similarity>& edges) {
  Json list = Json::array();
  for (const Similarity& edge : edges) list.push_back({edge.first + 1, edge.second + 1, edge.value});
  return list;
}

ordered_json reason_json(const FusionComponent& component) {
  ordered_json decisions = ordered_json::array();
  for (const FusionDecision& decision : component.decisions) {
    ordered_json entry{{"reason", describe(decision.reason)}, {"similarity", edges_json(decision.edges)}};
    if (decision.edges.size() == 2) entry["leaf_similarity"] = decision.leaf_similarity;
    if (!decision.fused.empty()) entry["fused"] = one_based(decision.fused);
    if (const auto& split = decision.split)
      entry["split"] = {split->primitive + 1, split->first + 1, split->second + 1};
    decisions.push_back(std::move(entry));
  }
  return {{"relaxed", edges_json(component.relaxed)}, {"decisions", std::move(decisions)}};
}

/// Entries of `of` that are not in `without`, as text; both sorted.
std::string surplus(const Json& of, const Json& without) {
  Json entries = Json::array();
  std::set_difference(of.begin(), of.end(), without.begin(), without.end(), std::back_inserter(entries));
  return entries.dump();
}

std::string difference(const std::string& key, const Json& expected, const Json& found) {
  const bool table = key == "in" || key == "out";
  if (!expected.is_array() || !found.is_array() || (table && expected.size() != found.size())) {
    return key + ": expected " + expected.dump() + ", found " + found.dump();
  }
  if (!table) return key + ": missing " + surplus(expected, found) + ", not expected " + surplus(found, expected);
  std::string text;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (expected[i] == found[i]) continue;
    text += (text.empty() ? "" : "; ") + key + " of " + std::to_string(i + 1) + ": expected " + expected[i].dump() +
            ", found " + found[i].dump();
  }
  return text;
}

}  // namespace

FusionCase read_fusion_case(const std::string& path) {
  const Json content = read_json(path);
  const JsonFields file(content, path, "");
  try {
    return {file.text_or("name", ""), read_problem(file), read_rules(file, content), read_expect(file, content)};
  } catch (const std::invalid_argument& error) {
    throw FormatError(path, 0, "a fusion case that makes sense", error.what());
  }
}

ordered_json to_case_json(const FusionPlan& plan) {
  Json fusion_set = Json::array();
  for (const std::vector<int>& tuple : plan.fusion_set) fusion_set.push_back(one_based(tuple));
  Json splits = Json::array();
  for (const PrimitiveSplit& split : plan.splits) {
    splits.push_back({split.primitive + 1, split.first + 1, split.second + 1});
  }
  Json transitions = Json::array();
  Json groups = Json::array();
  for (const TransitionGroup& group : plan.groups) {
    transitions.push_back({group.from + 1, group.to + 1, count_json(group.count)});
    Json sources = Json::array();
    for (const auto& [from, to] : group.sources) sources.push_back({from + 1, to + 1});
    groups.push_back({group.from + 1, group.to + 1, std::move(sources)});
  }
  return {{"in", one_based(plan.in)}, {"out", one_based(plan.out)},     {"fusion_set", fusion_set},
          {"splits", splits},         {"kept", one_based(plan.kept)},   {"transitions", transitions},
          {"groups", groups},         {"model_size", plan.model_size()}};
}

std::vector<std::string> differences(const Json& expect, const FusionPlan& plan) {
  const Json found = canonical(Json(to_case_json(plan)));
  const Json expected = canonical(expect);
  std::vector<std::string> lines;
  for (const auto& [key, value] : expected.items()) {
    if (!found.contains(key)) {
      lines.push_back(key + ": an unknown result");
    } else if (value != found.at(key)) {
      lines.push_back(difference(key, value, found.at(key)));
    }
  }
  return lines;
}

ordered_json explain_fusion(const std::string& name, const FusionProblem& problem, const FusionRules& rules,
                            const FusionPlan& plan) {
  Json transitions = Json::array();
  for (const TransitionCount& edge : problem.transitions) {
    transitions.push_back({edge.from + 1, edge.to + 1, count_json(edge.count)});
  }
  ordered_json chosen;
  options(rules, [&](const char* option, const bool& value) { chosen[option] = value; });
  ordered_json reasons = ordered_json::array();
  for (const FusionComponent& component : plan.components) reasons.push_back(reason_json(component));
  return {{"name", name},
          {"similarity_threshold", problem.similarity_threshold},
          {"previous_primitives", problem.previous_primitives},
          {"incoming_primitives", problem.incoming_primitives},
          {"similarity", edges_json(problem.similarities)},
          {"transitions", transitions},
          {"options", chosen},
          {"expect", to_case_json(plan)},
          {"reasons", reasons}};
}

}  // namespace sila
