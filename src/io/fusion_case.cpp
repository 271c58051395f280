#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "sila/core/errors.hpp"
#include "sila/io/files.hpp"
#include "sila/io/reports.hpp"

namespace sila {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::array kExpectKeys{"in", "out", "fusion_set", "splits", "kept", "transitions", "groups", "model_size"};

/// The options of a case file and what they set; `both` serves reading and writing.
template <class Rules, class Visitor>
void options(Rules& rules, Visitor&& visit) {
  visit("strict_relax", rules.strict_relax);
  visit("both_directions", rules.both_directions);
  visit("split_credit", rules.split_credit);
  visit("literal_self_transitions", rules.literal_self_transitions);
  visit("case_3_fuses_stronger", rules.case_3_fuses_stronger);
}

/// A problem of the content; the caller knows the path.
struct BadContent {
  std::string expected;
  std::string found;
};

const json& member(const json& object, const char* key) {
  if (!object.contains(key)) throw BadContent{std::string("the key '") + key + "'", "none"};
  return object.at(key);
}

int integer(const json& value, const char* key) {
  if (!value.is_number_integer() || std::abs(value.get<double>()) > 1e9) {
    throw BadContent{std::string("an integer in '") + key + "'", value.dump()};
  }
  return value.get<int>();
}

double number(const json& value, const char* key) {
  if (!value.is_number()) throw BadContent{std::string("a number in '") + key + "'", value.dump()};
  return value.get<double>();
}

std::string optional_text(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) return {};
  const auto* text = found->get_ptr<const std::string*>();
  if (text == nullptr) throw BadContent{std::string("a text in '") + key + "'", found->dump()};
  return *text;
}

/// A list of [index, index, number], indices 1-based in the file.
template <class Entry>
std::vector<Entry> triples(const json& list, const char* key) {
  if (!list.is_array()) throw BadContent{std::string("a list in '") + key + "'", list.dump()};
  std::vector<Entry> entries;
  for (const json& entry : list) {
    if (!entry.is_array() || entry.size() != 3) {
      throw BadContent{std::string("[primitive, primitive, number] in '") + key + "'", entry.dump()};
    }
    entries.push_back({integer(entry[0], key) - 1, integer(entry[1], key) - 1, number(entry[2], key)});
  }
  return entries;
}

FusionProblem read_problem(const json& file) {
  FusionProblem problem;
  problem.similarity_threshold = number(member(file, "similarity_threshold"), "similarity_threshold");
  problem.previous_primitives = integer(member(file, "previous_primitives"), "previous_primitives");
  problem.incoming_primitives = integer(member(file, "incoming_primitives"), "incoming_primitives");
  problem.similarities = triples<Similarity>(member(file, "similarity"), "similarity");
  for (Similarity& pair : problem.similarities) {
    if (pair.first > pair.second) std::swap(pair.first, pair.second);
  }
  problem.transitions = triples<TransitionCount>(member(file, "transitions"), "transitions");
  validate(problem);
  return problem;
}

FusionRules read_rules(const json& file) {
  FusionRules rules;
  if (!file.contains("options")) return rules;
  const json& given = file.at("options");
  if (!given.is_object()) throw BadContent{"an object in 'options'", given.dump()};
  std::size_t known = 0;
  std::string names;
  options(rules, [&](const char* name, bool& option) {
    names += (names.empty() ? "" : ", ") + std::string(name);
    if (!given.contains(name)) return;
    if (!given.at(name).is_boolean())
      throw BadContent{std::string("true or false in '") + name + "'", given.at(name).dump()};
    option = given.at(name).get<bool>();
    ++known;
  });
  if (known != given.size()) throw BadContent{"in 'options' only " + names, given.dump()};
  return rules;
}

/// Lists that are sets, and the sources within a group, in one order, so that a file may list them in any.
json canonical(json result) {
  for (const char* key : {"fusion_set", "splits", "kept", "transitions", "groups"}) {
    if (!result.contains(key) || !result[key].is_array()) continue;
    for (json& entry : result[key]) {
      if (std::string(key) == "fusion_set" && entry.is_array()) std::sort(entry.begin(), entry.end());
      const bool has_sources =
          std::string(key) == "groups" && entry.is_array() && entry.size() == 3 && entry[2].is_array();
      if (has_sources) std::sort(entry[2].begin(), entry[2].end());
    }
    std::sort(result[key].begin(), result[key].end());
  }
  return result;
}

json read_expect(const json& file) {
  const json& expect = member(file, "expect");
  if (!expect.is_object() || expect.empty()) throw BadContent{"an object with results in 'expect'", expect.dump()};
  for (const auto& [key, value] : expect.items()) {
    if (std::find(kExpectKeys.begin(), kExpectKeys.end(), key) == kExpectKeys.end()) {
      throw BadContent{"in 'expect' only in, out, fusion_set, splits, kept, transitions, groups, model_size",
                       "'" + key + "'"};
    }
  }
  return canonical(expect);
}

/// Counts are whole numbers unless a file says otherwise.
json count_json(double count) {
  if (count == std::floor(count) && std::abs(count) < 1e15) return static_cast<long long>(count);
  return count;
}

json one_based(const std::vector<int>& indices) {
  json list = json::array();
  for (const int index : indices) list.push_back(index + 1);
  return list;
}

json edges_json(const std::vector<Similarity>& edges) {
  json list = json::array();
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
std::string surplus(const json& of, const json& without) {
  json entries = json::array();
  std::set_difference(of.begin(), of.end(), without.begin(), without.end(), std::back_inserter(entries));
  return entries.dump();
}

std::string difference(const std::string& key, const json& expected, const json& found) {
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
  const json file = read_json(path);
  try {
    if (!file.is_object())
      throw BadContent{"a fusion case (an object)", std::string("JSON of type ") + file.type_name()};
    FusionCase result;
    result.name = optional_text(file, "name");
    result.note = optional_text(file, "note");
    result.problem = read_problem(file);
    result.rules = read_rules(file);
    result.expect = read_expect(file);
    return result;
  } catch (const BadContent& bad) {
    throw FormatError(path, 0, bad.expected, bad.found);
  } catch (const std::invalid_argument& error) {
    throw FormatError(path, 0, "a fusion case that makes sense", error.what());
  }
}

ordered_json to_case_json(const FusionPlan& plan) {
  json fusion_set = json::array();
  for (const std::vector<int>& tuple : plan.fusion_set) fusion_set.push_back(one_based(tuple));
  json splits = json::array();
  for (const PrimitiveSplit& split : plan.splits) {
    splits.push_back({split.primitive + 1, split.first + 1, split.second + 1});
  }
  json transitions = json::array();
  json groups = json::array();
  for (const TransitionGroup& group : plan.groups) {
    transitions.push_back({group.from + 1, group.to + 1, count_json(group.count)});
    json sources = json::array();
    for (const auto& [from, to] : group.sources) sources.push_back({from + 1, to + 1});
    groups.push_back({group.from + 1, group.to + 1, std::move(sources)});
  }
  return {{"in", one_based(plan.in)}, {"out", one_based(plan.out)},     {"fusion_set", fusion_set},
          {"splits", splits},         {"kept", one_based(plan.kept)},   {"transitions", transitions},
          {"groups", groups},         {"model_size", plan.model_size()}};
}

std::vector<std::string> differences(const json& expect, const FusionPlan& plan) {
  const json found = canonical(json(to_case_json(plan)));
  const json expected = canonical(expect);
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
  json transitions = json::array();
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
