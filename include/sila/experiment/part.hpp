#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "sila/experiment/experiment.hpp"

namespace sila {

/// Sums over a group of windows, at the whole horizon; so that groups of several places can be added. ADE and FDE are
/// those of the mean path.
struct GroupSums {
  double windows = 0.0;
  double mhd_m = 0.0;  ///< weighted over modes
  double mean_path_mhd_m = 0.0;
  double best_mhd_m = 0.0;
  double ade_m = 0.0;
  double fde_m = 0.0;
  double best_ade_m = 0.0;
  double nll = 0.0;
  double fallbacks = 0.0;
  double inside_50 = 0.0;  ///< of the nominal 50 % region
  double inside_90 = 0.0;
  double constant_mhd_m = 0.0;
  double constant_ade_m = 0.0;
  double constant_fde_m = 0.0;
  double constant_nll = 0.0;
  double stays_mhd_m = 0.0;
  double stays_ade_m = 0.0;
  double damped_mhd_m = 0.0;
  double damped_ade_m = 0.0;
  double linear_mhd_m = 0.0;
  double linear_ade_m = 0.0;
  double linear_nll = 0.0;
  double way_log_probability = 0.0;  ///< at forks, of the way that was taken [nats]
};

GroupSums operator+(const GroupSums& a, const GroupSums& b);

/// What one method gave at one place in one trial, as results are told; `place` is "all" for the sum over places.
struct PartRow {
  int trial = 0;
  int order = 0;
  std::string place;
  std::string method;
  std::map<std::string, GroupSums> groups;     ///< all, moving, standing, turning, forks, inside, outside
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
