#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include "sila/config.hpp"
#include "sila/core/trajectory.hpp"
#include "sila/io/scene.hpp"
#include "sila/predict/prediction.hpp"

namespace sila::python {

namespace nb = nanobind;
using namespace nb::literals;

/// A trajectory and the id that its rows had in the input, which its predictions carry.
struct Track {
  Trajectory trajectory;
  std::string input_id;
};

/// A prediction and whose it is.
struct TrackPrediction {
  std::string track;     ///< id as in the input
  std::string tracklet;  ///< unique id
  Prediction content;
  double metres_per_pixel = 0.0;  ///< of a model in pixels
};

/// A scene and what is drawn of it.
struct DrawnScene {
  Scene scene;
  std::map<std::string, std::vector<std::vector<Vector2>>> layers;  ///< polygons, by name
};

// One function a file: adds what it binds to the module.
void bind_errors(nb::module_& module);
void bind_core(nb::module_& module);
void bind_scene(nb::module_& module);
void bind_io(nb::module_& module);
void bind_model(nb::module_& module);
void bind_episode(nb::module_& module);
void bind_fleet(nb::module_& module);
void bind_predict(nb::module_& module);
void bind_eval(nb::module_& module);
void bind_experiments(nb::module_& module);
void bind_sim(nb::module_& module);
void bind_stream(nb::module_& module);

/// A frame as it travels between processes: bit for bit, where make_curb_frame would normalise again.
using FrameState = std::vector<double>;
FrameState state_of(const CurbFrame& frame);
CurbFrame frame_in(const FrameState& state);

/// The value of that name. Throws: std::invalid_argument that begins with `what` and lists the names.
template <class Enum>
Enum value_named(const char* what, std::span<const char* const> names, const std::string& name) {
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return static_cast<Enum>(found - names.begin());
  std::string known;
  for (const char* one : names) known += (known.empty() ? "" : ", ") + std::string(one);
  throw std::invalid_argument(std::string(what) + " = \"" + name + "\" is not one of " + known);
}

std::vector<std::string> texts_of(const std::vector<EpisodeId>& ids);

/// Without `input_ids` each track has its own id.
std::vector<Track> tracks_of(std::vector<Trajectory> trajectories, const std::vector<std::string>& input_ids = {});

/// The configuration of a JSON text that Python keeps; "{}" is the default one.
Config config_of(const std::string& json);

/// Each track in the frame of its corner, as `config.corners` wants it.
std::vector<FramedTrajectory> placed(const std::vector<Track>& tracks, const DrawnScene& scene, const Config& config);

}  // namespace sila::python
