#include <chrono>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "sila/io/reports.hpp"

namespace sila {
namespace {

using nlohmann::ordered_json;

/// The transitions of a model under the indices of the next one, as far as their primitives still are.
std::map<std::pair<int, int>, double> carried_counts(const ModelChange& change, const Model& previous) {
  const std::set<int> gone(change.gone.begin(), change.gone.end());
  std::vector<int> place;
  int next = 0;
  for (int i = 0; i < change.primitives_before; ++i) place.push_back(gone.contains(i) ? -1 : next++);
  std::map<std::pair<int, int>, double> counts;
  for (const Transition& edge : previous.transitions) {
    const int from = place[static_cast<std::size_t>(edge.from)], to = place[static_cast<std::size_t>(edge.to)];
    if (from >= 0 && to >= 0) counts[{from, to}] = edge.count;
  }
  return counts;
}

}  // namespace

ordered_json cells_json(const MotionPrimitive& primitive) {
  ordered_json cells = ordered_json::array();
  for (const CellVelocity& entry : primitive.cells) {
    const double degrees = std::atan2(entry.velocity.y(), entry.velocity.x()) * 180.0 / std::numbers::pi;
    cells.insert(cells.end(), {entry.cell.x, entry.cell.y, std::lround(degrees)});
  }
  return cells;
}

ordered_json to_json(const BudgetReport& report) {
  return {{"primitives", report.primitives},
          {"transitions", report.transitions},
          {"count", report.count},
          {"reduced", report.reduced}};
}

ordered_json to_json(const PrequentialError& error) {
  return {{"windows", error.windows}, {"model_m", error.model_m}, {"constant_velocity_m", error.constant_m}};
}

ordered_json to_json(const ModelChange& change, const Model& previous, const Model& updated) {
  ordered_json json{{"before", change.primitives_before}, {"after", change.primitives_after}, {"gone", change.gone}};
  json["added"] = ordered_json::array();
  for (const int k : change.added)
    json["added"].push_back(cells_json(updated.primitives.at(static_cast<std::size_t>(k))));
  json["fused"] = ordered_json::array();
  for (const FusedPrimitive& fused : change.fused) {
    json["fused"].push_back({{"primitive", fused.primitive},
                             {"previous", fused.previous},
                             {"incoming", fused.incoming},
                             {"cells", cells_json(updated.primitives.at(static_cast<std::size_t>(fused.primitive)))}});
  }
  json["split"] = ordered_json::array();
  for (const PrimitiveSplit& split : change.split)
    json["split"].push_back({split.primitive, split.first, split.second});
  json["incoming_split"] = change.incoming_split;
  json["transitions"] = ordered_json::array();
  std::map<std::pair<int, int>, double> carried = carried_counts(change, previous);
  for (const Transition& edge : updated.transitions) {
    const auto known = carried.find({edge.from, edge.to});
    if (known == carried.end() || known->second != edge.count)
      json["transitions"].push_back({edge.from, edge.to, edge.count});
    if (known != carried.end()) carried.erase(known);
  }
  json["transitions_gone"] = ordered_json::array();
  for (const auto& [edge, count] : carried) json["transitions_gone"].push_back({edge.first, edge.second});
  return json;
}

EpisodeRecord record_of(int number, const Model& previous, const Episode& episode) {
  const EpisodeReport& report = episode.report;
  const nlohmann::ordered_json statistics{
      {"standing", report.learn.standing},           {"unexplained", report.learn.unexplained},
      {"batch_primitives", report.learn.primitives}, {"batch_transitions", report.learn.transitions},
      {"subsumed", report.prune.subsumed},           {"evicted", to_json(report.budget)},
      {"prequential", to_json(report.prequential)},  {"change", to_json(report.change, previous, episode.model)}};
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const std::int64_t now_s = std::chrono::duration_cast<std::chrono::seconds>(now).count();
  return {number, report.tracks, report.seconds, report.size_before, report.size_after, statistics.dump(), now_s};
}

std::vector<EpisodeRecord> joined(std::vector<EpisodeRecord> first, const std::vector<EpisodeRecord>& second) {
  for (EpisodeRecord record : second) {
    record.number = static_cast<int>(first.size()) + 1;
    first.push_back(std::move(record));
  }
  return first;
}

}  // namespace sila
