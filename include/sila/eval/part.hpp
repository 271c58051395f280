#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "sila/eval/experiment.hpp"

namespace sila {

/// Sums over a group of windows, at the whole horizon; so that groups of several places can be added.
struct GroupSums {
  double windows = 0.0;
  double mhd_m = 0.0;  ///< weighted over modes
  double mean_path_mhd_m = 0.0;
  double best_mhd_m = 0.0;
  double nll = 0.0;
  double constant_mhd_m = 0.0;
  double constant_nll = 0.0;
  double fallbacks = 0.0;
  double inside_50 = 0.0;  ///< of the stated 50 % region
  double inside_90 = 0.0;
};

GroupSums operator+(const GroupSums& a, const GroupSums& b);

/// What one method gave at one place in one trial, as results are told; `place` is "all" for the sum over places.
struct PartRow {
  int trial = 0;
  int order = 0;
  std::string place;
  std::string method;
  std::map<std::string, GroupSums> groups;     ///< moving, turning, inside, outside
  std::map<std::string, GroupSums> by_person;  ///< of moving windows; a person is "place/track"
  std::size_t size = 0;
  double seconds_per_episode = 0.0;
};

/// The result of one job as JSON: what it was, every milestone, and the whole evaluation after the last.
nlohmann::ordered_json part_json(const Job& job, std::span<const Milestone> milestones);

/// The rows of a part: one a place, and their sum if there are several.
/// Throws: nlohmann::json::exception if it is not what part_json makes.
std::vector<PartRow> rows_of(const nlohmann::json& part);

}  // namespace sila
