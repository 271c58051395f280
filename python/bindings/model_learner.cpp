#include <tbb/parallel_for.h>

#include "experiments.hpp"
#include "sila/io/model_file.hpp"
#include "sila/refine/prune.hpp"
#include "sila/train/episode.hpp"
#include "sila/train/fleet.hpp"

namespace sila::python {
namespace {

/// The library's own methods, in the loop of episodes that the program learns by.
class ModelLearner {
 public:
  ModelLearner(const std::string& method, const std::string& config_json)
      : config_(config_of(config_json).episode), at_once_(method == "batch") {
    if (at_once_) config_.prune.enabled = false;
    update_ = update_of(method);
  }

  /// Begins with what other learners know of any place.
  void begin_with(const std::vector<const ModelLearner*>& others) {
    std::vector<Model> models;
    for (const ModelLearner* other : others) models.push_back(other->model_);
    model_ = make_prior(models);
  }

  void begin_with(const StoredModel& first) { model_ = first.model; }

  /// One more episode; of "batch" the only one.
  void learn(const FramedTracks& batch) {
    if (batch.tracks.empty()) return;
    if (at_once_) model_ = {};
    model_ = run_episodes(model_, batch.tracks, batch.tracks.size(), config_, update_).model;
  }

  /// As a fleet does: partitions of a site each, learnt by themselves and fused in a tree.
  void learn_tree(const FramedTracks& all, std::size_t batch, std::size_t partition_tracks) {
    std::vector<Partition> partitions;
    std::vector<Site> sites;
    std::vector<std::size_t> filling;  // of each site the partition that has room
    for (const FramedTrajectory& track : all.tracks) {
      const auto site = static_cast<std::size_t>(find_or_add_site(sites, track.frame));
      const bool first = site == filling.size();
      if (first) filling.push_back(0);
      if (first || partitions[filling[site]].tracks.size() == partition_tracks) {
        filling[site] = partitions.size();
        partitions.push_back({{}, batch, {}, {}});
      }
      partitions[filling[site]].tracks.push_back(track);
    }
    model_ = learn_fleet(model_, std::move(partitions), config_);
  }

  std::vector<TrackPrediction> predict(const WindowSet& set) const {
    const Predictor predictor(model_, config_.predict);
    std::vector<TrackPrediction> predictions(set.windows.size());
    tbb::parallel_for(std::size_t{0}, set.windows.size(), [&](std::size_t i) {
      const CurbTrajectory& observed = set.windows[i].observed;
      predictions[i] = {observed.id, observed.id, predictor.predict(observed)};
    });
    return predictions;
  }

  std::size_t model_size() const { return size(model_); }

  /// Of the file that the model would be stored in.
  std::size_t bytes() const { return model_bytes({.model = model_}).size(); }

 private:
  /// Keeps nothing of the tracks; the episode around it still learns from the errors of the kinematic model.
  static Episode keep_nothing(const Model& previous, const Batch& batch, const ModelSettings& settings) {
    Episode updated;
    updated.model.settings = settings;
    updated.model.sites = join_sites(previous.sites, sites_of(batch.tracks)).sites;
    updated.model.episodes = previous.episodes + 1;
    updated.model.tracks = previous.tracks + static_cast<long>(batch.tracks.size());
    return updated;
  }

  Update update_of(const std::string& method) const {
    if (method == "accumulate") return accumulate_update(config_);
    if (method == "retrain") return retrain_update(config_);
    if (method == "linear") return keep_nothing;
    if (method == "sila" || method == "batch" || method == "tree") return sila_update(config_);
    throw std::invalid_argument("ModelLearner: method = \"" + method + "\" is none of the library's");
  }

  EpisodeConfig config_;
  bool at_once_ = false;
  Update update_;
  Model model_;
};

}  // namespace

void bind_model_learner(nb::module_& module) {
  nb::class_<ModelLearner>(module, "ModelLearner", "SILA and its baselines inside the library.")
      .def(nb::init<const std::string&, const std::string&>(), "method"_a, "config"_a)
      .def("learn", &ModelLearner::learn, "batch"_a, nb::call_guard<nb::gil_scoped_release>())
      .def("begin_with", nb::overload_cast<const std::vector<const ModelLearner*>&>(&ModelLearner::begin_with),
           "others"_a, nb::call_guard<nb::gil_scoped_release>())
      .def("begin_with", nb::overload_cast<const StoredModel&>(&ModelLearner::begin_with), "first"_a)
      .def("learn_tree", &ModelLearner::learn_tree, "all"_a, "batch"_a, "partition_tracks"_a,
           nb::call_guard<nb::gil_scoped_release>())
      .def("predict", &ModelLearner::predict, "windows"_a, nb::call_guard<nb::gil_scoped_release>())
      .def_prop_ro("bytes", &ModelLearner::bytes, "Of the model's file.")
      .def_prop_ro("size", &ModelLearner::model_size);
}

}  // namespace sila::python
