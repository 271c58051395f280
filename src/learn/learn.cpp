#include "sila/learn/learn.hpp"

#include <tbb/parallel_for.h>

#include <map>
#include <set>
#include <utility>

#include "sila/gp/fuse_gps.hpp"
#include "sila/gp/train.hpp"
#include "sila/learn/dictionary.hpp"
#include "sila/learn/grid_vectors.hpp"
#include "sila/learn/segmentation.hpp"
#include "sila/learn/transitions.hpp"

namespace sila {
namespace {

using Observed = std::map<TransitionKey, ObservedTransition>;

std::vector<GpData> gp_data(const Observed& observed) {
  std::vector<GpData> data;
  for (const auto& [key, transition] : observed)
    data.push_back({transition.samples.positions, transition.samples.velocities});
  return data;
}

/// The bounds of the fit, configured in metres, in widths of the place where the model began.
GpConfig in_widths(GpConfig config, double width_m) {
  config.min_length_scale /= width_m;
  config.min_noise_variance /= width_m * width_m;
  return config;
}

/// The box of points, grown to a lattice: its sides are nobody's coordinates.
Eigen::AlignedBox2d box_of(const Eigen::MatrixXd& positions, const Eigen::Array2d& step) {
  const Eigen::Array2d least = positions.rowwise().minCoeff(), most = positions.rowwise().maxCoeff();
  return {Vector2(step * (least / step).floor()), Vector2(step * (most / step).ceil())};
}

/// One field a transition, fitted side by side; the result does not depend on the number of threads.
std::vector<Transition> fit_transitions(const Observed& observed, const Hyperparameters& start,
                                        const GpConfig& config) {
  const std::vector<GpData> data = gp_data(observed);
  const Hyperparameters pooled =
      config.hyperparameters == HyperparameterChoice::pooled ? pool_hyperparameters(data, start, config) : start;
  std::vector<Transition> transitions;
  for (const auto& [key, transition] : observed) {
    Transition& fitted = transitions.emplace_back();
    fitted.from = key.first, fitted.to = key.second, fitted.count = transition.count;
    fitted.last_episode = 1;
    fitted.support = static_cast<int>(transition.count);  // of one batch: each track once
  }
  tbb::parallel_for(std::size_t{0}, data.size(), [&](std::size_t i) {
    FlowField& field = transitions[i].field;
    field.gp = fit_sparse_gp(data[i], pooled, config);
    field.extent = box_of(data[i].inputs, config.lattice_step * field.gp.kernel.length_scales);
  });
  return transitions;
}

/// The outlook of each transition that has examples, and its samples beside those of its field.
void add_outlooks(std::map<TransitionKey, OutlookSamples> outlooks, const Hyperparameters& hyperparameters,
                  const GpConfig& config, Increment& increment) {
  std::vector<Transition>& transitions = increment.model.transitions;
  tbb::parallel_for(std::size_t{0}, transitions.size(), [&](std::size_t i) {
    const auto found = outlooks.find({transitions[i].from, transitions[i].to});
    if (found == outlooks.end()) return;
    OutlookSamples& samples = found->second;
    transitions[i].outlook = fuse_gps({}, {samples.states, samples.partings}, config, hyperparameters);
    increment.samples[i].states = std::move(samples.states);
    increment.samples[i].partings = std::move(samples.partings);
  });
}

/// Every moment of the batch, whatever transition it belongs to.
std::vector<const OutlookExample*> all_examples(const Batch& batch) {
  std::vector<const OutlookExample*> examples;
  for (const auto& of_track : batch.outlooks) {
    for (const OutlookExample& example : of_track) examples.push_back(&example);
  }
  return examples;
}

/// Notes how many tracks show each primitive.
void count_support(std::span<const std::vector<Segment>> segments, std::vector<MotionPrimitive>& primitives) {
  for (const std::vector<Segment>& runs : segments) {
    std::set<int> shown;
    for (const Segment& run : runs) shown.insert(run.primitive);
    for (const int p : shown) ++primitives[static_cast<std::size_t>(p)].support;
  }
}

LearnReport report_of(std::span<const GridVector> vectors, std::span<const std::vector<Segment>> segments,
                      const Dictionary& dictionary, const Model& model) {
  LearnReport report;
  report.tracks = static_cast<int>(vectors.size());
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    if (vectors[i].path.empty())
      ++report.standing;
    else if (segments[i].empty())
      ++report.unexplained;
  }
  report.primitives = model.primitives.size();
  report.transitions = model.transitions.size();
  report.objective = dictionary.objective.back();
  return report;
}

}  // namespace

Conventions begin_conventions(double reference_width_m, CurbScaling scaling, double sample_interval_s,
                              const GridConfig& config) {
  Conventions conventions;
  conventions.grid = {config.cell_m / reference_width_m, Vector2::Zero(), config.tile_cells};
  conventions.scaling = scaling;
  conventions.sample_interval_s = sample_interval_s;
  conventions.reference_width_m = reference_width_m;
  return conventions;
}

Hyperparameters starting_hyperparameters(const Conventions& conventions, const FieldConfig& config) {
  const double width_m = conventions.reference_width_m;
  const double signal = config.signal_std_mps / width_m, noise = config.noise_std_mps / width_m;
  return {{signal * signal, Eigen::VectorXd::Constant(2, config.length_scale_m / width_m)}, noise * noise};
}

Conventions with_outlooks(Conventions conventions, double horizon_s, const OutlookConfig& config) {
  if (config.enabled) conventions.outlook_horizon_s = horizon_s, conventions.outlook_knots = config.knots;
  return conventions;
}

Learnt learn(const Batch& batch, const Conventions& conventions, const LearnConfig& config,
             const OutlookConfig& outlook) {
  validate_fields("learn", config);
  const std::vector<CurbTrajectory>& tracks = batch.tracks;
  const double min_speed_mps = config.dictionary.min_speed_mps;
  const double cell_m = conventions.grid.cell * conventions.reference_width_m;
  std::vector<GridVector> vectors;  // tr_i
  for (const CurbTrajectory& track : tracks) {
    validate(track);
    vectors.push_back(to_grid_vector(track, conventions.grid, min_speed_mps));
  }
  Dictionary dictionary = learn_dictionary(vectors, conventions.grid, config.dictionary.gain_m / cell_m,
                                           config.dictionary.run_m / cell_m, config.dictionary);  // D, by ASNSC
  std::vector<std::vector<Segment>> segments;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    segments.push_back(segment(tracks[i], dictionary.codes[i], dictionary.primitives, conventions.grid, min_speed_mps,
                               config.segmentation));
  }
  Observed observed = observe_transitions(tracks, segments);  // T(i, j) and its samples
  Model model;
  model.conventions = conventions;
  model.transitions = fit_transitions(observed, starting_hyperparameters(conventions, config.field),
                                      in_widths(config.field.gp, conventions.reference_width_m));
  model.primitives = std::move(dictionary.primitives);
  count_support(segments, model.primitives);
  model.episodes = 1;
  model.tracks = static_cast<long>(tracks.size());
  const LearnReport report = report_of(vectors, segments, dictionary, model);
  Learnt learnt{{std::move(model), {}}, report};
  for (auto& [key, transition] : observed) learnt.increment.samples.push_back(std::move(transition.samples));
  add_outlooks(observe_outlooks(batch, segments), outlook_hyperparameters(conventions, outlook),
               outlook_gp_config(outlook), learnt.increment);
  learnt.increment.gait = gait_samples(all_examples(batch));
  learnt.increment.model.gait = learn_gait({}, learnt.increment.gait, outlook);
  for (const CurbTrajectory& track : tracks)
    learnt.increment.model.places = with_places(std::move(learnt.increment.model.places), {track.frame});
  return learnt;
}

}  // namespace sila
