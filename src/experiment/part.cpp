#include "sila/experiment/part.hpp"

#include <iterator>

#include "sila/evaluate/split.hpp"
#include "sila/io/evaluation_report.hpp"

namespace sila {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr double GroupSums::*kSums[] = {
    &GroupSums::windows,        &GroupSums::mhd_m,          &GroupSums::mean_path_mhd_m,    &GroupSums::best_mhd_m,
    &GroupSums::ade_m,          &GroupSums::fde_m,          &GroupSums::best_ade_m,         &GroupSums::nll,
    &GroupSums::fallbacks,      &GroupSums::inside_50,      &GroupSums::inside_90,          &GroupSums::constant_mhd_m,
    &GroupSums::constant_ade_m, &GroupSums::constant_fde_m, &GroupSums::constant_nll,       &GroupSums::stays_mhd_m,
    &GroupSums::stays_ade_m,    &GroupSums::damped_mhd_m,   &GroupSums::damped_ade_m,       &GroupSums::linear_mhd_m,
    &GroupSums::linear_ade_m,   &GroupSums::linear_nll,     &GroupSums::way_log_probability};
static_assert(sizeof(GroupSums) == std::size(kSums) * sizeof(double), "each sum is added and written");

GroupSums sums_of(const WindowScore& window) {
  const Metrics& model = window.model.back();
  const auto of = [&](Reference reference) { return window.references.at(static_cast<std::size_t>(reference)); };
  const Metrics constant = of(Reference::constant_velocity), stays = of(Reference::stays);
  const Metrics damped = of(Reference::damped_velocity), linear = of(Reference::linear);
  static_assert(kRegionProbabilities[1] == 0.5 && kRegionProbabilities[3] == 0.9);
  return {.windows = 1.0,
          .mhd_m = model.weighted_mhd_m,
          .mean_path_mhd_m = model.mean_path_mhd_m,
          .best_mhd_m = model.best_mhd_m,
          .ade_m = model.mean_path_ade_m,
          .fde_m = model.mean_path_fde_m,
          .best_ade_m = model.best_ade_m,
          .nll = model.nll,
          .fallbacks = window.fallback ? 1.0 : 0.0,
          .inside_50 = model.coverage[1],
          .inside_90 = model.coverage[3],
          .constant_mhd_m = constant.weighted_mhd_m,
          .constant_ade_m = constant.mean_path_ade_m,
          .constant_fde_m = constant.mean_path_fde_m,
          .constant_nll = constant.nll,
          .stays_mhd_m = stays.weighted_mhd_m,
          .stays_ade_m = stays.mean_path_ade_m,
          .damped_mhd_m = damped.weighted_mhd_m,
          .damped_ade_m = damped.mean_path_ade_m,
          .linear_mhd_m = linear.weighted_mhd_m,
          .linear_ade_m = linear.mean_path_ade_m,
          .linear_nll = linear.nll,
          .way_log_probability = window.way_log_probability.value_or(0.0)};
}

ordered_json to_json(const GroupSums& sums) {
  ordered_json list = ordered_json::array();
  for (const auto member : kSums) list.push_back(sums.*member);
  return list;
}

GroupSums sums_from(const json& list) {
  GroupSums sums;
  for (std::size_t i = 0; i < std::size(kSums); ++i) sums.*kSums[i] = list.at(i);
  return sums;
}

/// The sums of the groups and of each person's moving windows.
ordered_json sums_json(const Evaluation& evaluation) {
  std::map<std::string, GroupSums> groups, people;
  for (const char* name : {"all", "moving", "standing", "turning", "forks", "inside", "outside"}) groups[name] = {};
  for (const WindowScore& window : evaluation.windows) {
    const GroupSums sums = sums_of(window);
    const auto add = [&](GroupSums& to) { to = to + sums; };
    add(groups["all"]), add(groups[window.moving ? "moving" : "standing"]);
    if (!window.moving) continue;
    add(groups[window.inside ? "inside" : "outside"]);
    if (window.turning) add(groups["turning"]);
    if (window.way_log_probability) add(groups["forks"]);
    add(people[person_of(window.track)]);
  }
  ordered_json result;
  for (const auto& [name, sums] : groups) result["groups"][name] = to_json(sums);
  result["people"] = ordered_json::object();
  for (const auto& [name, sums] : people) result["people"][name] = to_json(sums);
  return result;
}

ordered_json milestone_json(const Milestone& milestone) {
  ordered_json result{{"episode", milestone.episode},
                      {"tracks", milestone.tracks},
                      {"size", milestone.size},
                      {"seconds", milestone.seconds}};
  for (const PlaceEvaluation& place : milestone.places) {
    for (const GroupScore& group : place.evaluation.groups) {
      if (group.windows == 0) continue;
      result["places"][place.place][group.name] = {{"windows", group.windows},
                                                   {"model", to_json(group.model.back())},
                                                   {"constant_velocity", to_json(group.constant.back())}};
    }
  }
  return result;
}

}  // namespace

GroupSums operator+(const GroupSums& a, const GroupSums& b) {
  GroupSums sum = a;
  for (const auto member : kSums) sum.*member += b.*member;
  return sum;
}

ordered_json part_json(const Job& job, std::span<const Milestone> milestones) {
  ordered_json part{{"trial", job.trial}, {"order", job.order}, {"scene", job.scene}, {"method", job.method}};
  part["milestones"] = ordered_json::array();
  for (const Milestone& milestone : milestones) part["milestones"].push_back(milestone_json(milestone));
  part["places"] = ordered_json::object();
  for (const PlaceEvaluation& place : milestones.back().places) {
    part["places"][place.place] = {{"sums", sums_json(place.evaluation)}, {"evaluation", to_json(place.evaluation)}};
  }
  return part;
}

std::vector<PartRow> rows_of(const json& part) {
  PartRow common;
  common.trial = part.at("trial"), common.order = part.at("order"), common.method = part.at("method");
  const json& milestones = part.at("milestones");
  common.size = milestones.back().at("size");
  for (const json& milestone : milestones) common.seconds_per_episode += milestone.at("seconds").get<double>();
  common.seconds_per_episode /= static_cast<double>(milestones.size());
  PartRow all = common;
  all.place = "all";
  std::vector<PartRow> rows;
  for (const auto& [name, place] : part.at("places").items()) {
    PartRow row = common;
    row.place = name;
    for (const auto& [group, sums] : place.at("sums").at("groups").items()) {
      row.groups[group] = sums_from(sums);
      all.groups[group] = all.groups[group] + row.groups[group];
    }
    for (const auto& [person, sums] : place.at("sums").at("people").items()) {
      row.by_person[name + "/" + person] = sums_from(sums);
    }
    all.by_person.insert(row.by_person.begin(), row.by_person.end());
    rows.push_back(std::move(row));
  }
  if (rows.size() > 1) rows.push_back(std::move(all));
  return rows;
}

}  // namespace sila
