#include <algorithm>
#include <cstdio>
#include <set>

#include "sila/core/counted.hpp"
#include "sila/io/reports.hpp"
#include "sila/io/scene.hpp"

namespace sila {
namespace {

nlohmann::ordered_json to_json(const GroupScore& group, const std::vector<double>& horizons_s) {
  nlohmann::ordered_json entry{
      {"windows", group.windows}, {"fallback_rate", group.fallback_rate}, {"modes", group.modes}};
  entry["horizons"] = nlohmann::ordered_json::array();
  for (std::size_t h = 0; h < horizons_s.size(); ++h) {
    entry["horizons"].push_back({{"horizon_s", horizons_s[h]},
                                 {"model", to_json(group.model[h])},
                                 {"constant_velocity", to_json(group.constant[h])}});
  }
  for (std::size_t r = 0; r < group.references.size(); ++r)
    entry["references"][kReferences[r]] = to_json(group.references[r]);
  return entry;
}

nlohmann::ordered_json to_json(const ChangeScore& score) {
  return {
      {"horizon_s", score.horizon_s}, {"windows", score.windows},       {"rate", score.rate},
      {"brier", score.brier},         {"base_brier", score.base_brier}, {"calibration_error", score.calibration_error}};
}

nlohmann::ordered_json by_outcome(const OutcomeProbabilities& values) {
  nlohmann::ordered_json entry;
  for (std::size_t k = 0; k < kOutcomeCount; ++k) entry[kOutcomes[k]] = values[k];
  return entry;
}

nlohmann::ordered_json to_json(const OutcomeScore& score) {
  return {{"horizon_s", score.horizon_s},
          {"windows", score.windows},
          {"rates", by_outcome(score.rates)},
          {"stated", by_outcome(score.stated)},
          {"brier", score.brier},
          {"base_brier", score.base_brier},
          {"calibration_error", score.calibration_error}};
}

std::string row(const GroupScore& group, double horizon_s, const Metrics& m, const Metrics& c) {
  char text[200];
  std::snprintf(text, sizeof text,
                "%-8s %7zu %5.1f  %6.3f %6.3f %6.3f  %6.3f %6.3f %6.3f %6.3f %7.2f | %6.3f %6.3f %6.3f %7.2f\n",
                group.name.c_str(), group.windows, horizon_s, m.weighted_mhd_m, m.most_likely_mhd_m, m.best_mhd_m,
                m.ade_m, m.fde_m, m.best_ade_m, m.best_fde_m, m.nll, c.weighted_mhd_m, c.ade_m, c.fde_m, c.nll);
  return text;
}

std::string row(const ChangeScore& score) {
  char text[200];
  std::snprintf(text, sizeof text, "%-8s %7zu %5.1f  %5.1f %%  %6.3f %6.3f %6.3f\n",
                score.motion_state == kStanding ? "start" : "stop", score.windows, score.horizon_s, 100.0 * score.rate,
                score.brier, score.base_brier, score.calibration_error);
  return text;
}

std::string row(const OutcomeScore& score) {
  char text[200];
  std::snprintf(text, sizeof text, "%-8s %7zu %5.1f ", score.motion_state == kStanding ? "standing" : "walking",
                score.windows, score.horizon_s);
  std::string line = text;
  for (std::size_t k = 0; k < kOutcomeCount; ++k) {
    std::snprintf(text, sizeof text, " %4.0f/%.0f", 100.0 * score.rates[k], 100.0 * score.stated[k]);
    line += text;
  }
  std::snprintf(text, sizeof text, "  %6.3f %6.3f %6.3f\n", score.brier, score.base_brier, score.calibration_error);
  return line + text;
}

/// How much of the truth the nominal regions hold at the whole horizon.
std::string coverage_row(const GroupScore& group) {
  std::string text = group.name + ": inside the";
  for (std::size_t p = 0; p < kRegionProbabilities.size(); ++p) {
    char part[60];
    std::snprintf(part, sizeof part, "%s %.0f %% region %.0f %%", p > 0 ? "," : "", 100.0 * kRegionProbabilities[p],
                  100.0 * group.model.back().coverage[p]);
    text += part;
  }
  return text + "\n";
}

/// The least number of these tracks that the model has learnt, as batches of the sizes of its episodes in this order.
std::size_t count_learnt(const StoredModel& stored, std::span<const FramedTrajectory> tracks) {
  std::set<std::size_t> sizes;  // of batches
  for (const EpisodeRecord& episode : stored.episodes) sizes.insert(static_cast<std::size_t>(episode.tracks));
  std::size_t learnt = 0;
  for (const std::size_t size : sizes) {
    std::size_t of_this_size = 0;
    for (std::size_t first = 0; size > 0 && first < tracks.size(); first += size) {
      const auto batch = tracks.subspan(first, std::min(size, tracks.size() - first));
      if (std::ranges::binary_search(stored.model.episode_ids, episode_id(batch))) of_this_size += batch.size();
    }
    learnt = std::max(learnt, of_this_size);
  }
  return learnt;
}

}  // namespace

nlohmann::ordered_json to_json(const Metrics& m) {
  nlohmann::ordered_json json;
  for (const auto& [name, member] : kMetrics) json[name] = m.*member;
  for (std::size_t p = 0; p < m.coverage.size(); ++p)
    json["coverage"].push_back({{"nominal", kRegionProbabilities[p]}, {"observed", m.coverage[p]}});
  return json;
}

nlohmann::ordered_json to_json(const Evaluation& evaluation) {
  nlohmann::ordered_json json;
  for (const GroupScore& group : evaluation.groups) json["groups"][group.name] = to_json(group, evaluation.horizons_s);
  json["changes"] = nlohmann::ordered_json::object();
  for (const ChangeScore& score : evaluation.changes)
    json["changes"][score.motion_state == kStanding ? "start" : "stop"].push_back(to_json(score));
  json["outcomes"] = nlohmann::ordered_json::object();
  for (const OutcomeScore& score : evaluation.outcomes)
    json["outcomes"][score.motion_state == kStanding ? "standing" : "walking"].push_back(to_json(score));
  json["skipped"] = evaluation.skipped;
  return json;
}

std::string to_text(const Evaluation& evaluation) {
  std::string text =
      "                        sila: MHD [m]                                             | constant velocity\n"
      "group    windows  to s  weight likely   best     ADE    FDE minADE minFDE     NLL |    MHD    ADE    FDE     "
      "NLL\n";
  for (const GroupScore& group : evaluation.groups) {
    if (group.windows == 0) text += group.name + ": no window\n";
    for (std::size_t h = 0; group.windows > 0 && h < evaluation.horizons_s.size(); ++h) {
      text += row(group, evaluation.horizons_s[h], group.model[h], group.constant[h]);
    }
  }
  for (const GroupScore& group : evaluation.groups) {
    char line[120];
    std::snprintf(line, sizeof line, "%s: %.1f %% fallback, %.1f modes on average\n", group.name.c_str(),
                  100.0 * group.fallback_rate, group.modes);
    if (group.windows > 0) text += line + coverage_row(group);
  }
  if (!evaluation.changes.empty()) text += "change   windows  to s     did   Brier  (base  rate)  ECE\n";
  for (const ChangeScore& score : evaluation.changes) text += row(score);
  if (!evaluation.outcomes.empty())
    text += "outcome  windows  to s  stays straight left right back [% came/stated]   Brier  (base  rate)  ECE\n";
  for (const OutcomeScore& score : evaluation.outcomes) text += row(score);
  for (const auto& [reason, tracks] : evaluation.skipped)
    text += counted(tracks, "track") + " gave no window: " + reason + "\n";
  return text;
}

std::string warning_of_learnt(const StoredModel& stored, std::span<const FramedTrajectory> tracks) {
  const std::size_t learnt = count_learnt(stored, tracks);
  if (learnt == 0) return {};
  return "the model has learnt at least " + std::to_string(learnt) + " of these " + counted(tracks.size(), "track") +
         ", so the errors are too small; use other tracks, or hold some back (--hold-out in `sila learn` and here; in "
         "Python sila.split_tracks)";
}

std::vector<std::string> warnings_before_learning(const StoredModel& stored, std::span<const FramedTrajectory> first,
                                                  std::span<const FramedTrajectory> known) {
  std::vector<std::string> warnings;
  if (std::string warning = warning_of_another_place(stored.model, first); !warning.empty())
    warnings.push_back(std::move(warning));
  if (std::ranges::binary_search(stored.model.episode_ids, episode_id(first))) return warnings;  // is not learnt again
  if (const std::size_t learnt = count_learnt(stored, known); learnt > 0)
    warnings.push_back("the model has learnt at least " + std::to_string(learnt) + " of the first " +
                       counted(known.size(), "track") + " in other batches; they are learnt again");
  return warnings;
}

}  // namespace sila
