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
#include <functional>
#include <map>
#include <stdexcept>
#include <type_traits>

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

/// One function a file: adds what it binds to the module.
using Bind = void(nb::module_& module);
Bind bind_errors, bind_core, bind_scene, bind_io, bind_model, bind_episode, bind_fleet, bind_predict, bind_eval,
    bind_experiments, bind_sim, bind_stream;
/// All of them, in the order in which they are called.
inline constexpr Bind* kBindings[] = {bind_errors, bind_core,    bind_scene, bind_io,          bind_model, bind_episode,
                                      bind_fleet,  bind_predict, bind_eval,  bind_experiments, bind_sim,   bind_stream};

/// What `of` makes of each part, in order.
template <class Parts, class Of>
auto list_of(const Parts& parts, Of&& of) {
  std::vector<std::decay_t<std::invoke_result_t<Of&, decltype(*parts.begin())>>> list;
  for (const auto& part : parts) list.push_back(std::invoke(of, part));
  return list;
}

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
