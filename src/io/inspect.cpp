#include "sila/io/inspect.hpp"

#include <algorithm>
#include <iomanip>
#include <set>
#include <sstream>

#include "sila/model/packing.hpp"

namespace sila {
namespace {

/// What both forms tell, counted once.
struct Facts {
  std::size_t cells = 0;           ///< that any primitive covers, each once
  std::size_t arrows = 0;          ///< cells of all primitives
  Eigen::Index pseudo_inputs = 0;  ///< of all transitions
  double points = 0.0;             ///< samples absorbed by all transitions
  double seconds = 0.0;            ///< of all recorded episodes
};

Facts facts_of(const StoredModel& stored) {
  Facts facts;
  std::set<CellKey> covered;
  for (const MotionPrimitive& primitive : stored.model.primitives) {
    facts.arrows += primitive.cells.size();
    for (const CellVelocity& entry : primitive.cells) covered.insert(entry.cell);
  }
  facts.cells = covered.size();
  for (const Transition& transition : stored.model.transitions) {
    facts.pseudo_inputs += transition.field.gp.pseudo_inputs.cols();
    facts.pseudo_inputs += transition.field.gp_y.pseudo_inputs.cols();
    facts.points += transition.field.gp.points;
  }
  for (const EpisodeRecord& episode : stored.episodes) facts.seconds += episode.seconds;
  return facts;
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

nlohmann::ordered_json sites_json(const Model& model) {
  nlohmann::ordered_json sites = nlohmann::ordered_json::array();
  const auto pair = [](const Vector2& v) { return nlohmann::ordered_json{v.x(), v.y()}; };
  for (std::size_t i = 0; i < model.sites.size(); ++i) {
    const auto& [frame, episodes, tracks, error_statistics, global_residual] = model.sites[i];
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
  for (const Transition* transition : order) {
    text << (text.tellp() > 0 ? ", " : "") << transition->from << " -> " << transition->to << " (" << transition->count
         << ")";
  }
  return order.empty() ? "none" : std::move(text).str();
}

}  // namespace

std::string describe(const StoredModel& stored) {
  const Model& model = stored.model;
  const Facts facts = facts_of(stored);
  std::ostringstream text;
  const auto line = [&](const char* name) -> std::ostream& {
    return text << '\n' << std::left << std::setw(14) << name;
  };
  text << std::left << std::setw(14) << "file" << stored.bytes << " bytes, written by sila " << stored.sila_version;
  line("learnt from") << model.tracks << " tracks in " << model.episodes << " episodes";
  line("size") << size(model) << " = " << model.primitives.size() << " primitives + " << model.transitions.size()
               << " transitions";
  line("primitives") << facts.arrows << " arrows in " << facts.cells << " cells";
  line("transitions") << facts.pseudo_inputs << " pseudo-inputs, " << facts.points << " samples absorbed";
  line("busiest") << busiest_transitions(model, 5);
  line("grid") << "cells of " << model.settings.grid.cell * model.settings.reference_width_m << " m, tiles of "
               << model.settings.grid.tile_cells << " cells";
  line("frame") << "scaled by " << kCurbScalings[static_cast<std::size_t>(model.settings.scaling)] << ", a unit is "
                << model.settings.reference_width_m << " m";
  for (std::size_t i = 0; i < model.sites.size(); ++i) {
    const Site& site = model.sites[i];
    line("site") << "(" << site.frame.origin_m.x() << ", " << site.frame.origin_m.y() << ") m: " << site.tracks
                 << " tracks in " << site.episodes << " episodes, " << transitions_of(model, i) << " transitions, "
                 << (site.error_statistics.empty() ? "not calibrated" : "calibrated");
  }
  line("samples") << "every " << model.settings.sample_interval_s << " s";
  line("time") << facts.seconds << " s in " << stored.episodes.size() << " recorded episodes";
  if (!stored.episodes.empty()) {
    const EpisodeRecord& last = stored.episodes.back();
    line("last episode") << "number " << last.number << ": " << last.tracks << " tracks, " << last.seconds
                         << " s, size " << last.size_before << " -> " << last.size_after;
  }
  text << '\n';
  return std::move(text).str();
}

nlohmann::ordered_json inspect_json(const StoredModel& stored) {
  const Model& model = stored.model;
  const Facts facts = facts_of(stored);
  nlohmann::ordered_json episodes = nlohmann::ordered_json::array();
  for (const EpisodeRecord& episode : stored.episodes) {
    nlohmann::ordered_json statistics = nlohmann::ordered_json::parse(episode.statistics, nullptr, false);
    if (statistics.is_object()) statistics.erase("change");  // thousands of numbers, which `sila report` draws
    episodes.push_back({{"number", episode.number},
                        {"tracks", episode.tracks},
                        {"seconds", episode.seconds},
                        {"size_before", episode.size_before},
                        {"size_after", episode.size_after},
                        {"statistics", std::move(statistics)}});
  }
  return {{"primitives", model.primitives.size()},
          {"transitions", model.transitions.size()},
          {"size", size(model)},
          {"episodes", model.episodes},
          {"tracks", model.tracks},
          {"bytes", stored.bytes},
          {"model_bytes", packed_bytes(stored.model)},
          {"sila_version", stored.sila_version},
          {"cells", facts.cells},
          {"arrows", facts.arrows},
          {"pseudo_inputs", facts.pseudo_inputs},
          {"points", facts.points},
          {"seconds", facts.seconds},
          {"grid",
           {{"cell", model.settings.grid.cell},
            {"origin", {model.settings.grid.origin.x(), model.settings.grid.origin.y()}},
            {"tile_cells", model.settings.grid.tile_cells}}},
          {"scaling", kCurbScalings[static_cast<std::size_t>(model.settings.scaling)]},
          {"sharing", kSiteSharings[static_cast<std::size_t>(model.sharing)]},
          {"sites", sites_json(model)},
          {"sample_interval_s", model.settings.sample_interval_s},
          {"reference_width_m", model.settings.reference_width_m},
          {"configuration", nlohmann::ordered_json::parse(stored.configuration, nullptr, false)},
          {"records", std::move(episodes)}};
}

}  // namespace sila
