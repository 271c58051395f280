#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <iomanip>
#include <optional>
#include <set>
#include <sstream>

#include "core/concatenate.hpp"
#include "sila/core/counted.hpp"
#include "sila/io/reports.hpp"
#include "sila/model/packing.hpp"

namespace sila {
namespace {

using nlohmann::ordered_json;

/// Counts of a stored model, for both forms of the report.
struct Counts {
  std::size_t cells = 0;           ///< that any primitive covers, each once
  std::size_t arrows = 0;          ///< cells of all primitives
  Eigen::Index pseudo_inputs = 0;  ///< of all transitions
  double points = 0.0;             ///< samples of all transitions
  double seconds = 0.0;            ///< of all recorded episodes
};

Counts counts_of(const StoredModel& stored) {
  Counts counts;
  std::set<CellKey> covered;
  for (const MotionPrimitive& primitive : stored.model.primitives) {
    counts.arrows += primitive.cells.size();
    for (const CellVelocity& entry : primitive.cells) covered.insert(entry.cell);
  }
  counts.cells = covered.size();
  for (const Transition& transition : stored.model.transitions) {
    counts.pseudo_inputs += transition.field.gp.pseudo_inputs.cols() + transition.field.gp_y.pseudo_inputs.cols();
    counts.points += transition.field.gp.points;
  }
  for (const EpisodeRecord& episode : stored.episodes) counts.seconds += episode.seconds;
  return counts;
}

/// How many transitions a site has shown.
std::ptrdiff_t transitions_of(const Model& model, std::size_t site) {
  return std::ranges::count_if(model.transitions, [&](const Transition& transition) {
    return std::ranges::binary_search(transition.sites, static_cast<int>(site), {}, &SiteCount::site);
  });
}

/// Which share of all that was counted was seen at this site.
double share_of(const Model& model, std::size_t site) {
  double all = 0.0, here = 0.0;
  for (const Transition& transition : model.transitions) {
    all += transition.count;
    for (const SiteCount& part : transition.sites) here += part.site == static_cast<int>(site) ? part.count : 0.0;
  }
  return all > 0.0 ? here / all : 0.0;
}

ordered_json sites_json(const Model& model) {
  ordered_json sites = ordered_json::array();
  const auto pair = [](const Vector2& v) { return ordered_json{v.x(), v.y()}; };
  for (std::size_t i = 0; i < model.sites.size(); ++i) {
    const auto& [frame, episodes, tracks] = model.sites[i];
    sites.push_back({{"origin", pair(frame.origin_m)},
                     {"axis_1", pair(frame.axis_1)},
                     {"axis_2", pair(frame.axis_2)},
                     {"sidewalk_width_m", frame.sidewalk_width_m},
                     {"episodes", episodes},
                     {"tracks", tracks},
                     {"transitions", transitions_of(model, i)},
                     {"share", share_of(model, i)}});
  }
  return sites;
}

std::string busiest_transitions(const Model& model, std::size_t how_many) {
  std::vector<const Transition*> order;
  for (const Transition& transition : model.transitions) order.push_back(&transition);
  std::ranges::stable_sort(order, std::ranges::greater{}, &Transition::count);
  order.resize(std::min(order.size(), how_many));
  std::ostringstream text;
  for (const Transition* edge : order)
    text << (text.tellp() > 0 ? ", " : "") << edge->from << " -> " << edge->to << " (" << edge->count << ")";
  return order.empty() ? "none" : std::move(text).str();
}

std::size_t length_of(const ordered_json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_array() ? found->size() : 0;
}

/// A member of the statistics of an episode; null if there is none.
ordered_json member_of(const EpisodeRecord& episode, const char* key) {
  const ordered_json statistics = ordered_json::parse(episode.statistics, nullptr, false);
  return statistics.is_object() && statistics.contains(key) ? statistics[key] : ordered_json();
}

constexpr std::array kChanges = {"added", "fused", "split", "gone"};

/// How many primitives an episode changed, by kChanges; empty if its record does not say.
ordered_json changes_of(const EpisodeRecord& episode) {
  const ordered_json change = member_of(episode, "change");
  ordered_json changes = ordered_json::object();
  if (!change.is_object()) return changes;
  for (const char* kind : kChanges) changes[kind] = length_of(change, kind);
  if (change.contains("incoming_split") && change["incoming_split"].is_number_unsigned())
    changes["split"] = length_of(change, "split") + change["incoming_split"].get<std::size_t>();
  return changes;
}

/// The prequential error of an episode; none if its record has no valid one or no window.
std::optional<PrequentialError> prequential_of(const EpisodeRecord& episode) {
  const ordered_json sums = member_of(episode, "prequential");
  const auto is_sum = [&](const char* key) { return sums.contains(key) && sums[key].is_number(); };
  if (!is_sum("model_m") || !is_sum("constant_velocity_m")) return {};
  if (!sums.contains("windows") || !sums["windows"].is_number_unsigned()) return {};
  const PrequentialError error{sums["windows"], sums["model_m"], sums["constant_velocity_m"]};
  const bool valid = error.windows > 0 && error.model_m >= 0.0 && error.constant_m > 0.0;
  return valid ? std::optional(error) : std::nullopt;
}

/// The learning curve is evaluated after this number of further tracks, too: half of those learnt.
long more_tracks(const Model& model) {
  return model.tracks - model.tracks / 2;
}

double with_more(const Model& model) {
  return static_cast<double>(model.tracks) + static_cast<double>(more_tracks(model));
}

/// As ISO 8601, UTC; "-" if not known.
std::string when(const EpisodeRecord& episode) {
  const auto time = static_cast<std::time_t>(episode.committed_s);
  std::tm parts{};
  if (episode.committed_s <= 0 || gmtime_r(&time, &parts) == nullptr) return "-";
  return concatenate(std::put_time(&parts, "%FT%TZ"));
}

std::string line_of(const char* name, std::size_t same, std::size_t changed, std::size_t only_a, std::size_t only_b) {
  return concatenate(std::left, std::setw(13), name, same, " the same, ", changed, " changed, ", only_a, " only in A, ",
                     only_b, " only in B\n");
}

template <class List, class Text>
std::string list(const char* title, const List& items, Text&& text) {
  if (items.empty()) return {};
  std::string line = std::string("  ") + title + ":";
  for (const auto& item : items) line += " " + text(item);
  return line + "\n";
}

std::string describe_site(const Model& model, std::size_t index) {
  const auto& [frame, episodes, tracks] = model.sites[index];
  const bool calibrated = windows_in(entry_of(model.refinement.error_statistics, index).density) > 0.0;
  return "(" + std::to_string(std::llround(frame.origin_m.x())) + ", " +
         std::to_string(std::llround(frame.origin_m.y())) + ") m: " + counted(tracks, "track") + " in " +
         counted(episodes, "episode") + ", " + counted(transitions_of(model, index), "transition") +
         (calibrated ? ", calibrated" : ", not calibrated");
}

}  // namespace

ordered_json record_json(const EpisodeRecord& episode) {
  return {{"number", episode.number},
          {"tracks", episode.tracks},
          {"seconds", episode.seconds},
          {"size_before", episode.size_before},
          {"size_after", episode.size_after}};
}

std::vector<LearningPoint> learning_points(const StoredModel& stored) {
  if (stored.model.tracks <= 0) return {};
  std::vector<LearningPoint> points;
  double tracks = 0.0;
  for (const EpisodeRecord& episode : stored.episodes) {
    if (tracks > 0.0 && episode.size_before == 0) return {};
    const auto error = prequential_of(episode);
    if (error && tracks > 0.0) points.push_back({tracks, *error});
    tracks += std::max(0.0, static_cast<double>(episode.tracks));
  }
  return points;
}

std::string describe_learning(const Model& model, std::span<const LearningPoint> points) {
  const auto curve = fit_learning_curve(points);
  if (!curve) return {};
  const Estimate now = expected_error(*curve, static_cast<double>(model.tracks));
  const Estimate later = expected_error(*curve, with_more(model));
  return concatenate(std::fixed, std::setprecision(3), now.value, " of constant velocity after ",
                     counted(model.tracks, "track"), " (fitted to ", counted(curve->points, "episode"), "); with ",
                     more_tracks(model), " more expect ", later.value, " (", later.lower, " to ", later.upper, "), ",
                     std::setprecision(1), 100.0 * std::abs(1.0 - later.value / now.value), " % ",
                     later.value > now.value ? "more" : "less");
}

ordered_json learning_json(const StoredModel& stored) {
  ordered_json json{{"points", ordered_json::array()}, {"fit", nullptr}};
  const std::vector<LearningPoint> points = learning_points(stored);
  for (const LearningPoint& point : points) {
    ordered_json& entry = json["points"].emplace_back(ordered_json{{"tracks", point.tracks}});
    entry.update(to_json(point.error));
  }
  const auto curve = fit_learning_curve(points);
  if (!curve) return json;
  const auto expected = [&](double tracks) {
    const Estimate error = expected_error(*curve, tracks);
    return ordered_json{{"tracks", tracks}, {"ratio", error.value}, {"lower", error.lower}, {"upper", error.upper}};
  };
  json["fit"] = {{"asymptote", curve->coefficients[0]},
                 {"slope", curve->coefficients[1]},
                 {"episodes", curve->points},
                 {"text", describe_learning(stored.model, points)},
                 {"now", expected(static_cast<double>(stored.model.tracks))},
                 {"with_more", expected(with_more(stored.model))}};
  return json;
}

std::string describe(const StoredModel& stored) {
  const Model& model = stored.model;
  const Counts counts = counts_of(stored);
  std::ostringstream text;
  const auto line = [&](const char* name) -> std::ostream& {
    return text << '\n' << std::left << std::setw(14) << name;
  };
  text << std::left << std::setw(14) << "file" << stored.bytes << " bytes, written by sila " << stored.sila_version;
  line("learnt from") << counted(model.tracks, "track") << " in " << counted(model.episodes, "episode");
  line("size") << size(model) << " = " << counted(model.primitives.size(), "primitive") << " + "
               << counted(model.transitions.size(), "transition");
  line("primitives") << counted(counts.arrows, "arrow") << " in " << counted(counts.cells, "cell");
  line("transitions") << counted(counts.pseudo_inputs, "pseudo-input") << ", " << counts.points << " samples";
  line("busiest") << busiest_transitions(model, 5);
  line("grid") << "cells of " << model.settings.grid.cell * model.settings.reference_width_m << " m, tiles of "
               << model.settings.grid.tile_cells << " cells";
  line("frame") << "scaled by " << kCurbScalings[static_cast<std::size_t>(model.settings.scaling)] << ", a unit is "
                << model.settings.reference_width_m << " m";
  for (std::size_t i = 0; i < model.sites.size(); ++i) line("site") << describe_site(model, i);
  const ordered_json configuration = ordered_json::parse(stored.configuration, nullptr, false);
  if (const double scale = configuration.value("metres_per_pixel", 0.0); scale > 0.0)
    line("units") << "pixels of " << scale << " m";
  if (const double windows = windows_in(model.refinement.prior.density); windows > 0.0)
    line("prior") << "of " << counted(std::lround(windows), "window") << " at other places";
  line("samples") << "every " << model.settings.sample_interval_s << " s";
  line("time") << counts.seconds << " s in " << counted(stored.episodes.size(), "recorded episode");
  if (!stored.episodes.empty()) {
    const EpisodeRecord& last = stored.episodes.back();
    line("last episode") << "number " << last.number << ": " << counted(last.tracks, "track") << ", " << last.seconds
                         << " s, size " << last.size_before << " -> " << last.size_after;
  }
  if (const std::string learning = describe_learning(model, learning_points(stored)); !learning.empty())
    line("learning curve") << " " << learning;
  text << '\n';
  return std::move(text).str();
}

ordered_json inspect_json(const StoredModel& stored) {
  const Model& model = stored.model;
  const Counts counts = counts_of(stored);
  ordered_json episodes = ordered_json::array();
  for (const EpisodeRecord& episode : stored.episodes) {
    ordered_json statistics = ordered_json::parse(episode.statistics, nullptr, false);
    if (statistics.is_object()) statistics.erase("change");  // thousands of numbers, which `sila report` draws
    episodes.push_back(record_json(episode));
    episodes.back()["statistics"] = std::move(statistics);
  }
  return {{"primitives", model.primitives.size()},
          {"transitions", model.transitions.size()},
          {"size", size(model)},
          {"episodes", model.episodes},
          {"tracks", model.tracks},
          {"bytes", stored.bytes},
          {"model_bytes", packed_bytes(stored.model)},
          {"sila_version", stored.sila_version},
          {"cells", counts.cells},
          {"arrows", counts.arrows},
          {"pseudo_inputs", counts.pseudo_inputs},
          {"points", counts.points},
          {"seconds", counts.seconds},
          {"grid",
           {{"cell", model.settings.grid.cell},
            {"origin", {model.settings.grid.origin.x(), model.settings.grid.origin.y()}},
            {"tile_cells", model.settings.grid.tile_cells}}},
          {"scaling", kCurbScalings[static_cast<std::size_t>(model.settings.scaling)]},
          {"sharing", kSiteSharings[static_cast<std::size_t>(model.sharing)]},
          {"sites", sites_json(model)},
          {"prior_windows", windows_in(model.refinement.prior.density)},
          {"sample_interval_s", model.settings.sample_interval_s},
          {"reference_width_m", model.settings.reference_width_m},
          {"configuration", ordered_json::parse(stored.configuration, nullptr, false)},
          {"learning_curve", learning_json(stored)},
          {"records", std::move(episodes)}};
}

std::string describe_log(const StoredModel& stored, int oldest) {
  std::ostringstream text;
  const auto column = [&](int width) -> std::ostream& { return text << std::right << std::setw(width); };
  text << "episode  when                  tracks   seconds   size          added  fused  split  gone  error\n";
  for (const EpisodeRecord& episode : stored.episodes) {
    column(7) << episode.number << "  " << std::left << std::setw(20) << when(episode);
    column(8) << episode.tracks;
    column(10) << std::fixed << std::setprecision(3) << episode.seconds;
    column(6) << episode.size_before << " -> " << std::left << std::setw(6) << episode.size_after;
    const ordered_json changes = changes_of(episode);
    const auto number = [&](const char* kind) { return changes.empty() ? "-" : changes[kind].dump(); };
    column(5) << number("added");
    column(7) << number("fused");
    column(7) << number("split");
    column(6) << number("gone");
    const auto error = prequential_of(episode);
    column(7) << (error ? concatenate(std::fixed, std::setprecision(3), error->ratio()) : "-") << '\n';
  }
  if (stored.episodes.empty()) return "no episode is recorded\n";
  if (oldest == stored.episodes.back().number)
    text << "cannot be rolled back: no earlier model is kept\n";
  else
    text << "can be rolled back to episode " << oldest << " and those after it\n";
  return std::move(text).str();
}

ordered_json log_json(const StoredModel& stored, int oldest) {
  ordered_json list = ordered_json::array();
  for (const EpisodeRecord& episode : stored.episodes) {
    ordered_json& entry = list.emplace_back(record_json(episode));
    entry["committed_s"] = episode.committed_s;
    entry.update(changes_of(episode));
    if (const auto error = prequential_of(episode)) entry["prequential"] = to_json(*error);
  }
  return {{"episodes", std::move(list)}, {"oldest_rollback", oldest}};
}

std::string describe(const ModelComparison& difference, std::span<const HorizonDifference> predictions,
                     std::size_t windows) {
  const auto edge = [](const std::pair<int, int>& pair) {
    return std::to_string(pair.first) + "->" + std::to_string(pair.second);
  };
  const auto number = [](int primitive) { return std::to_string(primitive); };
  std::ostringstream text;
  text << line_of("primitives", difference.same_primitives, difference.changed_primitives.size(),
                  difference.primitives_of_a.size(), difference.primitives_of_b.size())
       << list("changed (A=B)", difference.changed_primitives,
               [&](const PrimitivePair& pair) { return number(pair.a) + "=" + number(pair.b); })
       << list("only in A", difference.primitives_of_a, number) << list("only in B", difference.primitives_of_b, number)
       << line_of("transitions", difference.same_transitions, difference.changed_transitions.size(),
                  difference.transitions_of_a.size(), difference.transitions_of_b.size())
       << list("changed (of A)", difference.changed_transitions,
               [&](const TransitionPair& pair) { return edge(pair.a); })
       << list("only in A", difference.transitions_of_a, edge) << list("only in B", difference.transitions_of_b, edge);
  if (windows == 0) return std::move(text).str() + "predictions  not compared: no window to predict\n";
  text << "predictions  mean paths on " << counted(windows, "window") << " are apart by\n" << std::fixed;
  for (const HorizonDifference& horizon : predictions) {
    text << "  at " << std::setprecision(1) << horizon.horizon_s << std::setprecision(3) << " s: " << horizon.mean_m
         << " m on average, " << horizon.max_m << " m at most\n";
  }
  return std::move(text).str();
}

ordered_json to_json(const ModelComparison& difference, std::span<const HorizonDifference> predictions,
                     std::size_t windows) {
  ordered_json primitives{{"same", difference.same_primitives}, {"changed", ordered_json::array()}};
  for (const PrimitivePair& pair : difference.changed_primitives)
    primitives["changed"].push_back({{"a", pair.a}, {"b", pair.b}, {"similarity", pair.similarity}});
  primitives["only_a"] = difference.primitives_of_a;
  primitives["only_b"] = difference.primitives_of_b;
  ordered_json transitions{{"same", difference.same_transitions}, {"changed", ordered_json::array()}};
  for (const TransitionPair& pair : difference.changed_transitions) {
    transitions["changed"].push_back(
        {{"a", pair.a}, {"b", pair.b}, {"count_a", pair.count_a}, {"count_b", pair.count_b}});
  }
  transitions["only_a"] = difference.transitions_of_a;
  transitions["only_b"] = difference.transitions_of_b;
  ordered_json distances = ordered_json::array();
  for (const HorizonDifference& horizon : predictions)
    distances.push_back({{"horizon_s", horizon.horizon_s}, {"mean_m", horizon.mean_m}, {"max_m", horizon.max_m}});
  return {{"primitives", std::move(primitives)},
          {"transitions", std::move(transitions)},
          {"windows", windows},
          {"predictions", std::move(distances)}};
}

}  // namespace sila
