#include "sila/eval/part.hpp"

#include "sila/eval/episodes.hpp"
#include "sila/eval/report.hpp"

namespace sila {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

GroupSums sums_of(const WindowScore& window) {
  const Metrics &model = window.model.back(), &constant = window.constant.back();
  static_assert(kRegionProbabilities[1] == 0.5 && kRegionProbabilities[3] == 0.9);
  return {1.0,
          model.weighted_mhd_m,
          model.mean_path_mhd_m,
          model.best_mhd_m,
          model.nll,
          constant.weighted_mhd_m,
          constant.nll,
          window.fallback ? 1.0 : 0.0,
          model.coverage[1],
          model.coverage[3]};
}

ordered_json to_json(const GroupSums& s) {
  return {s.windows,        s.mhd_m,        s.mean_path_mhd_m, s.best_mhd_m, s.nll,
          s.constant_mhd_m, s.constant_nll, s.fallbacks,       s.inside_50,  s.inside_90};
}

GroupSums sums_from(const json& j) {
  return {j.at(0), j.at(1), j.at(2), j.at(3), j.at(4), j.at(5), j.at(6), j.at(7), j.at(8), j.at(9)};
}

/// The sums of the groups and of each person's moving windows.
ordered_json sums_json(const Evaluation& evaluation) {
  std::map<std::string, GroupSums> groups, people;
  for (const char* name : {"moving", "turning", "inside", "outside"}) groups[name] = {};
  for (const WindowScore& window : evaluation.windows) {
    if (!window.moving) continue;
    const GroupSums sums = sums_of(window);
    const auto add = [&](GroupSums& to) { to = to + sums; };
    add(groups["moving"]), add(groups[window.inside ? "inside" : "outside"]);
    if (window.turning) add(groups["turning"]);
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
      if (group.windows == 0 || group.name == "all") continue;
      result["places"][place.place][group.name] = {{"windows", group.windows},
                                                   {"model", to_json(group.model.back())},
                                                   {"constant_velocity", to_json(group.constant.back())}};
    }
  }
  return result;
}

}  // namespace

GroupSums operator+(const GroupSums& a, const GroupSums& b) {
  return {a.windows + b.windows,
          a.mhd_m + b.mhd_m,
          a.mean_path_mhd_m + b.mean_path_mhd_m,
          a.best_mhd_m + b.best_mhd_m,
          a.nll + b.nll,
          a.constant_mhd_m + b.constant_mhd_m,
          a.constant_nll + b.constant_nll,
          a.fallbacks + b.fallbacks,
          a.inside_50 + b.inside_50,
          a.inside_90 + b.inside_90};
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
