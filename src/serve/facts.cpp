#include "sila/serve/facts.hpp"

#include <algorithm>
#include <sstream>

#include "sila/version.hpp"

namespace sila {
namespace {

/// Writes families of metrics: help and type once, then the samples.
class MetricsText {
 public:
  void family(const char* name, const char* type, const char* help) {
    name_ = name;
    text_ << "# HELP sila_" << name << ' ' << help << "\n# TYPE sila_" << name << ' ' << type << '\n';
  }
  template <class Number>
  void sample(Number value, const std::string& labels = {}, const char* suffix = "") {
    text_ << "sila_" << name_ << suffix;
    if (!labels.empty()) text_ << '{' << labels << '}';
    text_ << ' ' << value << '\n';
  }
  template <class Number>
  void one(const char* name, const char* type, const char* help, Number value) {
    family(name, type, help);
    sample(value);
  }
  std::string text() const { return text_.str(); }

 private:
  std::string name_;
  std::ostringstream text_;
};

std::string number(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::string label(const char* name, const std::string& value) {
  return std::string(name) + "=\"" + value + "\"";
}

void add_lines(MetricsText& out, const Facts& facts) {
  const Account& account = facts.account;
  out.one("lines_total", "counter", "lines read", facts.lines);
  out.family("refused_total", "counter", "lines and connections refused, by reason");
  for (const RefusalText& refusal : kRefusals)
    out.sample(facts.refused[static_cast<std::size_t>(refusal.refusal)], label("reason", std::string(refusal.name)));
  out.one("detections_total", "counter", "detections taken", account.taken);
  out.one("detections_early_total", "counter", "detections for which no prediction was due", account.early);
  out.one("predictions_total", "counter", "predictions made", account.answered);
  out.family("predictions_dropped_total", "counter", "predictions that were due and did not come, by reason");
  out.sample(account.superseded, label("reason", "superseded"));
  out.sample(facts.dropped_outgoing, label("reason", "slow_reader"));
  out.one("clock_jumps_total", "counter", "clocks of streams that were set anew", account.clock_jumps);
  out.one("tracks_total", "counter", "tracks that ended", account.tracks);
  out.one("connections", "gauge", "open connections that send or receive lines", facts.connections);
  out.one("watchers", "gauge", "open live pages", facts.watchers);
  out.one("pedestrians", "gauge", "open tracks", facts.people);
  out.one("predictions_waiting", "gauge", "predictions that are due now", facts.queued);
  out.one("lines_waiting", "gauge", "lines read and not looked at yet", facts.waiting_lines);
  out.family("prediction_seconds", "histogram", "from reading a detection to handing over its prediction");
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < kLatencyEdges_s.size(); ++i) {
    below += facts.latency.counts[i];
    out.sample(below, label("le", number(kLatencyEdges_s[i])), "_bucket");
  }
  below += facts.latency.counts.back();
  out.sample(below, label("le", "+Inf"), "_bucket");
  out.sample(facts.latency.sum_s, {}, "_sum");
  out.sample(below, {}, "_count");
}

void add_errors(MetricsText& out, const Facts& facts, const char* name, const char* help, auto value) {
  out.family(name, "gauge", help);
  for (const bool moving : {false, true}) {
    const std::vector<HorizonSums>& sums = moving ? facts.moving : facts.all;
    for (std::size_t h = 0; h < sums.size(); ++h) {
      if (sums[h].windows == 0) continue;
      out.sample(value(sums[h]) / static_cast<double>(sums[h].windows),
                 label("who", moving ? "moving" : "all") + "," + label("horizon_s", number(facts.horizons_s[h])));
    }
  }
}

void add_scores(MetricsText& out, const Facts& facts) {
  const Account& account = facts.account;
  out.one("predictions_scored_total", "counter", "predictions whose future happened", account.scored);
  out.one("predictions_unscorable_total", "counter", "predictions whose track ended before the horizon",
          account.unscorable);
  out.one("predictions_unscored_total", "counter", "predictions that were not kept for judging", account.unscored);
  out.one("predictions_unjudged", "gauge", "predictions that wait for their future", account.waiting_for_future);
  out.one("pedestrians_remembered", "gauge", "pedestrians that the following figures are over", facts.remembered);
  add_errors(out, facts, "weighted_mhd_metres", "weighted modified Hausdorff distance of predictions",
             [](const HorizonSums& sums) { return sums.weighted_mhd_m; });
  add_errors(out, facts, "constant_velocity_mhd_metres", "that of constant velocity on the same windows",
             [](const HorizonSums& sums) { return sums.constant_mhd_m; });
  out.family("coverage_ratio", "gauge", "share of truths in the nominal regions, averaged over pedestrians");
  for (std::size_t h = 0; h < facts.coverage.size(); ++h) {
    for (std::size_t p = 0; p < kRegionProbabilities.size(); ++p) {
      if (facts.coverage[h][p] < 0.0) continue;
      out.sample(facts.coverage[h][p], label("nominal", number(kRegionProbabilities[p])) + "," +
                                           label("horizon_s", number(facts.horizons_s[h])));
    }
  }
  out.one("novelty", "gauge", "mean novelty of the observed paths", facts.novelty);
  out.one("drift_alarm", "gauge", "1 if the error of the last pedestrians left its band", facts.drift.alarm ? 1 : 0);
  if (!facts.drift.known) return;
  out.one("drift_error_metres", "gauge", "error of the last pedestrians who moved", facts.drift.error_m);
  out.one("drift_reference_metres", "gauge", "that of those before them", facts.drift.reference_m);
  out.one("drift_half_width_metres", "gauge", "half width of the band round it", facts.drift.half_width_m);
}

void add_learning(MetricsText& out, const Facts& facts) {
  const Learning& learning = facts.learning;
  out.one("episodes_total", "counter", "episodes learnt and kept since the start", learning.episodes);
  out.one("episodes_failed_total", "counter", "episodes that failed; the model stayed what it was",
          learning.failed_episodes);
  out.one("episodes_known_total", "counter", "batches that the model had learnt before, and that changed nothing",
          learning.known_episodes);
  out.one("model_renewals_total", "counter", "models taken up that another process put in the file", learning.renewals);
  out.one("tracks_learnt_total", "counter", "tracks learnt since the start", learning.learnt_tracks);
  out.one("tracks_forgotten_total", "counter", "tracks that were not learnt", learning.forgotten_tracks);
  out.one("tracks_waiting", "gauge", "tracks that wait to be learnt", learning.waiting_tracks);
  out.one("learning", "gauge", "1 while an episode runs", learning.busy ? 1 : 0);
  out.one("episode_seconds", "gauge", "that the last episode took", learning.last_episode_s);
  out.one("model_size", "gauge", "primitives and transitions", facts.model_size);
  out.one("model_primitives", "gauge", "primitives of the model", facts.primitives);
  out.one("model_transitions", "gauge", "transitions of the model", facts.transitions);
  out.one("model_episodes", "gauge", "episodes of the model's life", facts.model_episodes);
  out.one("model_tracks", "gauge", "tracks of the model's life", facts.model_tracks);
}

nlohmann::ordered_json errors_json(const std::vector<HorizonSums>& sums) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const HorizonSums& horizon : sums) {
    const auto n = static_cast<double>(std::max<std::size_t>(1, horizon.windows));
    list.push_back({{"windows", horizon.windows},
                    {"mhd_m", horizon.weighted_mhd_m / n},
                    {"constant_mhd_m", horizon.constant_mhd_m / n}});
  }
  return list;
}

}  // namespace

void add(LatencyHistogram& histogram, double seconds) {
  const auto bin = std::lower_bound(kLatencyEdges_s.begin(), kLatencyEdges_s.end(), seconds) - kLatencyEdges_s.begin();
  ++histogram.counts[static_cast<std::size_t>(bin)];
  histogram.sum_s += seconds;
}

void read_core(Facts& facts, const Live& live, const Learner& learner, const LiveSettings& settings) {
  facts.account = live.account;
  facts.streams = live.streams.size(), facts.queued = live.queue.size(), facts.people = 0;
  for (const auto& [id, stream] : live.streams) facts.people += stream.people.size();
  facts.horizons_s = horizons_until(settings.episode.predict.horizon_s);
  facts.all = totals(live.board, false), facts.moving = totals(live.board, true);
  facts.coverage = coverage(live.board);
  facts.remembered = live.board.size();
  facts.novelty = mean_novelty(live.board);
  facts.drift = drift_of(live.board, settings.live);
  facts.learning = learner.learning();
  const auto snapshot = learner.snapshot();
  facts.model_size = size(snapshot->model);
  facts.primitives = snapshot->model.primitives.size(), facts.transitions = snapshot->model.transitions.size();
  facts.model_episodes = snapshot->model.episodes, facts.model_tracks = snapshot->model.tracks;
}

std::string metrics_text(const Facts& facts) {
  MetricsText out;
  out.family("info", "gauge", "version of the service");
  out.sample(1, label("version", SILA_VERSION));
  add_lines(out, facts);
  add_scores(out, facts);
  add_learning(out, facts);
  return out.text();
}

nlohmann::ordered_json to_json(const Facts& facts) {
  std::uint64_t refused = 0;
  for (const std::uint64_t count : facts.refused) refused += count;
  nlohmann::ordered_json json{{"kind", "facts"}, {"horizons_s", facts.horizons_s}};
  json["all"] = errors_json(facts.all), json["moving"] = errors_json(facts.moving);
  json["nominal"] = kRegionProbabilities, json["coverage"] = facts.coverage;
  json["remembered"] = facts.remembered, json["novelty"] = facts.novelty;
  json["drift"] = {{"known", facts.drift.known},
                   {"alarm", facts.drift.alarm},
                   {"error_m", facts.drift.error_m},
                   {"reference_m", facts.drift.reference_m},
                   {"half_width_m", facts.drift.half_width_m}};
  json["detections"] = facts.account.taken, json["predictions"] = facts.account.answered;
  json["dropped"] = facts.account.superseded + facts.dropped_outgoing, json["refused"] = refused;
  json["scored"] = facts.account.scored, json["pedestrians"] = facts.people;
  json["learning"] = facts.learning.busy, json["tracks_waiting"] = facts.learning.waiting_tracks;
  json["last_error"] = facts.learning.last_error;
  json["size"] = facts.model_size, json["episodes"] = facts.model_episodes, json["tracks"] = facts.model_tracks;
  return json;
}

}  // namespace sila
