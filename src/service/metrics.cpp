#include <algorithm>
#include <iomanip>
#include <numeric>
#include <sstream>

#include "core/concatenate.hpp"
#include "io/json_file.hpp"
#include "sila/service/server.hpp"
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
  /// A family of one sample: a counter if its name says so, else a gauge.
  template <class Number>
  void one(const char* name, const char* help, Number value) {
    family(name, std::string_view(name).ends_with("_total") ? "counter" : "gauge", help);
    sample(value);
  }
  std::string text() const { return text_.str(); }

 private:
  std::string name_;
  std::ostringstream text_;
};

std::string label(const char* name, const std::string& value) {
  return std::string(name) + "=\"" + value + "\"";
}

void add_traffic(MetricsText& out, const ServiceMetrics& metrics) {
  const Counters& counters = metrics.counters;
  out.one("lines_total", "lines read", metrics.lines);
  out.family("rejected_total", "counter", "rejected lines and connections, by reason");
  for (const RejectionText& text : kRejections)
    out.sample(metrics.rejected[static_cast<std::size_t>(text.rejection)], label("reason", std::string(text.name)));
  out.one("detections_total", "accepted detections", counters.detections);
  out.one("detections_not_due_total", "detections for which no prediction was due", counters.not_due);
  out.one("predictions_total", "predictions made", counters.predictions);
  out.family("predictions_dropped_total", "counter", "predictions that were due and not delivered, by reason");
  out.sample(counters.superseded, label("reason", "superseded"));
  out.sample(metrics.slow_reader_dropped, label("reason", "slow_reader"));
  out.one("clock_resets_total", "resets of the clocks of streams", counters.clock_resets);
  out.one("tracks_total", "tracks that ended", counters.tracks);
  out.one("connections", "open connections", metrics.connections);
  out.one("live_pages", "open live pages", metrics.live_pages);
  out.one("pedestrians", "open tracks", metrics.pedestrians);
  out.one("predictions_due", "predictions that are due and not made yet", metrics.due_predictions);
  out.one("lines_queued", "lines read and not ingested yet", metrics.queued_lines);
}

void add_latency(MetricsText& out, const LatencyHistogram& latency) {
  out.family("prediction_seconds", "histogram", "from reading a detection to sending its prediction");
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < kLatencyEdges_s.size(); ++i) {
    below += latency.counts[i];
    out.sample(below, label("le", concatenate(kLatencyEdges_s[i])), "_bucket");
  }
  below += latency.counts.back();
  out.sample(below, label("le", "+Inf"), "_bucket");
  out.sample(concatenate(std::setprecision(15), latency.sum_s), {}, "_sum");  // grows for months
  out.sample(below, {}, "_count");
}

void add_errors(MetricsText& out, const ServiceMetrics& metrics, const char* name, const char* help, auto value) {
  out.family(name, "gauge", help);
  for (const bool moving : {false, true}) {
    const std::vector<HorizonSums>& sums = moving ? metrics.moving : metrics.all;
    for (std::size_t h = 0; h < sums.size(); ++h) {
      if (sums[h].windows == 0) continue;
      out.sample(
          value(sums[h]) / static_cast<double>(sums[h].windows),
          label("windows", moving ? "moving" : "all") + "," + label("horizon_s", concatenate(metrics.horizons_s[h])));
    }
  }
}

void add_coverage(MetricsText& out, const ServiceMetrics& metrics) {
  out.family("coverage_ratio", "gauge", "share of outcomes inside the nominal regions, averaged over pedestrians");
  for (std::size_t h = 0; h < metrics.coverage.size(); ++h) {
    for (std::size_t p = 0; p < kRegionProbabilities.size(); ++p) {
      if (metrics.coverage[h][p] < 0.0) continue;
      out.sample(metrics.coverage[h][p], label("nominal", concatenate(kRegionProbabilities[p])) + "," +
                                             label("horizon_s", concatenate(metrics.horizons_s[h])));
    }
  }
}

void add_scores(MetricsText& out, const ServiceMetrics& metrics) {
  const Counters& counters = metrics.counters;
  out.one("predictions_scored_total", "predictions whose future was observed", counters.scored);
  out.one("predictions_unscorable_total", "predictions whose track ended before the horizon", counters.unscorable);
  out.one("predictions_not_retained_total", "predictions that were not retained for scoring", counters.not_retained);
  out.one("scores_pending", "predictions retained until their future is observed", counters.pending_scores);
  out.one("pedestrians_scored", "pedestrians that the following metrics cover", metrics.scored_pedestrians);
  add_errors(out, metrics, "weighted_mhd_metres", "weighted modified Hausdorff distance of predictions",
             [](const HorizonSums& sums) { return sums.weighted_mhd_m; });
  add_errors(out, metrics, "constant_velocity_mhd_metres", "that of constant velocity on the same windows",
             [](const HorizonSums& sums) { return sums.constant_mhd_m; });
  add_coverage(out, metrics);
  out.one("novelty", "mean novelty of the observed paths", metrics.novelty);
  out.one("drift_alarm", "1 if the error of the last pedestrians is outside its band", metrics.drift.alarm ? 1 : 0);
  if (!metrics.drift.known) return;
  out.one("drift_error_metres", "error of the last pedestrians that moved", metrics.drift.error_m);
  out.one("drift_reference_metres", "error of the earlier pedestrians", metrics.drift.reference_m);
  out.one("drift_half_width_metres", "half width of the band around it", metrics.drift.half_width_m);
}

void add_learning(MetricsText& out, const ServiceMetrics& metrics) {
  const LearnerStatus& learner = metrics.learner;
  out.one("episodes_total", "episodes learnt and stored since the start", learner.episodes);
  out.one("episodes_failed_total", "episodes that failed and left the model unchanged", learner.failed_episodes);
  out.one("episodes_known_total", "batches that the model had learnt before, without effect", learner.known_episodes);
  out.one("model_reloads_total", "reloads of a model that another process changed", learner.reloads);
  out.one("tracks_learnt_total", "tracks learnt since the start", learner.learnt_tracks);
  out.one("tracks_discarded_total", "tracks that were not learnt", learner.discarded_tracks);
  out.one("tracks_waiting", "tracks that wait to be learnt", learner.waiting_tracks);
  out.one("learning", "1 while an episode runs", learner.learning ? 1 : 0);
  out.one("episode_seconds", "duration of the last episode", learner.last_episode_s);
  out.one("model_size", "primitives and transitions", metrics.model_size);
  out.one("model_primitives", "primitives of the model", metrics.primitives);
  out.one("model_transitions", "transitions of the model", metrics.transitions);
  out.one("model_episodes", "episodes of the model", metrics.model_episodes);
  out.one("model_tracks", "tracks of the model", metrics.model_tracks);
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

ServiceMetrics core_metrics(const StreamCore& core, const LearnerThread& learner, const ServiceSettings& settings) {
  ServiceMetrics metrics;
  metrics.counters = core.counters;
  for (const auto& [id, stream] : core.streams) metrics.pedestrians += stream.pedestrians.size();
  metrics.due_predictions = due_predictions(core);
  metrics.horizons_s = horizons_until(settings.episode.predict.horizon_s);
  metrics.all = totals(core.scores, false);
  metrics.moving = totals(core.scores, true);
  metrics.coverage = coverage(core.scores);
  metrics.scored_pedestrians = core.scores.size();
  metrics.novelty = mean_novelty(core.scores);
  metrics.drift = drift_of(core.scores);
  metrics.learner = learner.status();
  const std::shared_ptr<const Snapshot> snapshot = learner.snapshot();
  const Model& model = snapshot->model;
  metrics.model_size = size(model);
  metrics.primitives = model.primitives.size();
  metrics.transitions = model.transitions.size();
  metrics.model_episodes = model.episodes;
  metrics.model_tracks = model.tracks;
  return metrics;
}

std::string metrics_text(const ServiceMetrics& metrics) {
  MetricsText out;
  out.family("info", "gauge", "version of the service");
  out.sample(1, label("version", std::string(build_version())));
  add_traffic(out, metrics);
  add_latency(out, metrics.latency);
  add_scores(out, metrics);
  add_learning(out, metrics);
  return out.text();
}

std::string metrics_message(const ServiceMetrics& metrics) {
  const Counters& counters = metrics.counters;
  const std::uint64_t rejected = std::accumulate(metrics.rejected.begin(), metrics.rejected.end(), std::uint64_t{0});
  const nlohmann::ordered_json json{
      {"kind", "metrics"},
      {"horizons_s", metrics.horizons_s},
      {"all", errors_json(metrics.all)},
      {"moving", errors_json(metrics.moving)},
      {"nominal", kRegionProbabilities},
      {"coverage", metrics.coverage},
      {"scored_pedestrians", metrics.scored_pedestrians},
      {"novelty", metrics.novelty},
      {"drift",
       {{"known", metrics.drift.known},
        {"alarm", metrics.drift.alarm},
        {"error_m", metrics.drift.error_m},
        {"reference_m", metrics.drift.reference_m},
        {"half_width_m", metrics.drift.half_width_m}}},
      {"detections", counters.detections},
      {"predictions", counters.predictions},
      {"dropped", counters.superseded + metrics.slow_reader_dropped},
      {"rejected", rejected},
      {"scored", counters.scored},
      {"pedestrians", metrics.pedestrians},
      {"learning", metrics.learner.learning},
      {"tracks_waiting", metrics.learner.waiting_tracks},
      {"last_error", metrics.learner.last_error},
      {"size", metrics.model_size},
      {"episodes", metrics.model_episodes},
      {"tracks", metrics.model_tracks},
      {"learning_curve", metrics.learner.learning_curve},
  };
  return one_line(json);
}

}  // namespace sila
