#include "sila/learn/learn.hpp"

#include <tbb/parallel_for.h>

#include <iterator>
#include <set>
#include <utility>

#include "gp/fit.hpp"
#include "learn/steps.hpp"

namespace sila {
namespace {

/// The initial hyperparameters of fields, in curb units of `width_m` metres.
Hyperparameters starting_hyperparameters(double width_m) {
  const double signal = FieldConfig::signal_std_mps / width_m, noise = FieldConfig::noise_std_mps / width_m;
  return {{signal * signal, Eigen::VectorXd::Constant(2, FieldConfig::length_scale_m / width_m)}, noise * noise};
}

/// The bounds of the fit, configured in metres, in curb units of `unit_m` metres.
GpConfig in_curb_units(GpConfig config, double unit_m) {
  config.min_length_scale /= unit_m;
  config.min_noise_variance /= unit_m * unit_m;
  return config;
}

/// The box of points, grown to a lattice: its sides are not coordinates of one pedestrian.
Eigen::AlignedBox2d box_of(const Eigen::MatrixXd& positions, const Eigen::Array2d& step) {
  const Eigen::Array2d least = positions.rowwise().minCoeff(), most = positions.rowwise().maxCoeff();
  return {Vector2(step * (least / step).floor()), Vector2(step * (most / step).ceil())};
}

/// The fields are fitted in parallel; the result does not depend on the number of threads.
std::vector<Transition> fit_transitions(const ObservedTransitions& observed, const Hyperparameters& start,
                                        FieldOutputs outputs, const GpConfig& config) {
  std::vector<Transition> transitions;
  std::vector<const GpData*> samples;
  for (const auto& [key, observation] : observed) {
    Transition& transition = transitions.emplace_back();
    transition.from = key.first;
    transition.to = key.second;
    transition.sites = observation.sites;
    transition.count = total_count(transition.sites);
    transition.support = static_cast<int>(transition.count);  // of one batch: each track once
    samples.push_back(&observation.samples);
  }
  tbb::parallel_for(std::size_t{0}, transitions.size(), [&](std::size_t i) {
    const auto& [positions, velocities] = *samples[i];
    FlowField& field = transitions[i].field;
    if (outputs == FieldOutputs::independent) {
      field.gp = fit_sparse_gp({positions, velocities.col(0)}, start, config);
      field.gp_y = fit_sparse_gp({positions, velocities.col(1)}, start, config);
    } else {
      field.gp = fit_sparse_gp(*samples[i], start, config);
    }
    field.extent = box_of(positions, config.lattice_step * field.gp.kernel.length_scales);
  });
  return transitions;
}

/// The indices of the tracks of each site, in the order of the first tracks of the sites.
std::vector<std::vector<std::size_t>> indices_by_site(std::span<const CurbTrajectory> tracks) {
  std::vector<Site> sites;
  std::vector<std::vector<std::size_t>> track_indices;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const auto site = static_cast<std::size_t>(find_or_add_site(sites, tracks[i].frame));
    track_indices.resize(sites.size());
    track_indices[site].push_back(i);
  }
  return track_indices;
}

/// Adds the increment of a further site without fusing.
void append(LearnResult& all, LearnResult more, const std::vector<std::size_t>& track_indices) {
  Model& model = all.increment.model;
  const auto shift = static_cast<int>(model.primitives.size()), site = static_cast<int>(model.sites.size());
  for (Transition& transition : more.increment.model.transitions) {
    transition.from += shift;
    transition.to += shift;
    for (SiteCount& part : transition.sites) part.site += site;
    model.transitions.push_back(std::move(transition));
  }
  for (std::size_t i = 0; i < track_indices.size(); ++i) {
    for (Segment& run : more.segments[i]) run.primitive += shift;
    all.segments[track_indices[i]] = std::move(more.segments[i]);
  }
  std::ranges::move(more.increment.model.primitives, std::back_inserter(model.primitives));
  std::ranges::move(more.increment.model.sites, std::back_inserter(model.sites));
  std::ranges::move(more.increment.samples, std::back_inserter(all.increment.samples));
  model.tracks += more.increment.model.tracks;
  LearnReport& report = all.report;
  report.standing += more.report.standing;
  report.unexplained += more.report.unexplained;
  report.primitives += more.report.primitives;
  report.transitions += more.report.transitions;
}

/// Sets the support: the number of tracks that show each primitive.
void count_support(std::span<const std::vector<Segment>> segments, std::vector<MotionPrimitive>& primitives) {
  for (const std::vector<Segment>& runs : segments) {
    std::set<int> shown;
    for (const Segment& run : runs) shown.insert(run.primitive);
    for (const int p : shown) ++primitives[static_cast<std::size_t>(p)].support;
  }
}

LearnReport report_of(std::span<const GridVector> vectors, std::span<const std::vector<Segment>> segments,
                      const Model& model) {
  LearnReport report;
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    if (vectors[i].path.empty())
      ++report.standing;
    else if (segments[i].empty())
      ++report.unexplained;
  }
  report.primitives = model.primitives.size();
  report.transitions = model.transitions.size();
  return report;
}

/// Learns a batch whose sites share primitives and transitions.
LearnResult learn_together(std::span<const CurbTrajectory> tracks, const ModelSettings& settings,
                           const LearnConfig& config) {
  const double cell_m = settings.grid.cell * settings.reference_width_m;
  std::vector<GridVector> vectors;  // tr_i
  for (const CurbTrajectory& track : tracks) {
    validate(track);
    vectors.push_back(to_grid_vector(track, settings.grid));
  }
  Dictionary dictionary = learn_dictionary(vectors, settings.grid, config.dictionary.gain_m / cell_m,
                                           config.dictionary.run_m / cell_m, config.dictionary);  // D, by ASNSC
  std::vector<std::vector<Segment>> segments;
  for (std::size_t i = 0; i < tracks.size(); ++i)
    segments.push_back(segment(tracks[i], dictionary.codes[i], dictionary.primitives, settings.grid));
  Model model;
  model.settings = settings;
  model.sites = sites_of(tracks);
  std::vector<int> sites;
  for (const CurbTrajectory& track : tracks) sites.push_back(find_or_add_site(model.sites, track.frame));
  auto observed = observe_transitions(tracks, segments, sites, config.field.stride_s);  // T(i, j), samples
  model.transitions = fit_transitions(observed, starting_hyperparameters(settings.reference_width_m),
                                      config.field.outputs, in_curb_units(config.field.gp, settings.reference_width_m));
  model.primitives = std::move(dictionary.primitives);
  count_support(segments, model.primitives);
  model.episodes = 1;
  model.tracks = static_cast<long>(tracks.size());
  const LearnReport report = report_of(vectors, segments, model);
  LearnResult learnt{{std::move(model), {}}, report, std::move(segments)};
  for (auto& [key, transition] : observed) learnt.increment.samples.push_back(std::move(transition.samples));
  return learnt;
}

}  // namespace

ModelSettings begin_settings(double reference_width_m, CurbScaling scaling, double sample_interval_s,
                             const GridConfig& config) {
  const Grid grid{config.cell_m / reference_width_m, Vector2::Zero(), config.tile_cells};
  return {grid, scaling, sample_interval_s, reference_width_m};
}

LearnResult learn(std::span<const CurbTrajectory> tracks, const ModelSettings& settings, const LearnConfig& config,
                  SiteSharing sharing) {
  validate_fields("learn", config);
  if (sharing == SiteSharing::shared) return learn_together(tracks, settings, config);
  LearnResult all;
  all.increment.model.settings = settings;
  all.increment.model.episodes = 1;
  all.segments.resize(tracks.size());
  for (const std::vector<std::size_t>& track_indices : indices_by_site(tracks)) {
    std::vector<CurbTrajectory> of_site;
    for (const std::size_t i : track_indices) of_site.push_back(tracks[i]);
    append(all, learn_together(of_site, settings, config), track_indices);
  }
  return all;
}

}  // namespace sila
