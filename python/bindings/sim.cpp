#include "bindings.hpp"
#include "sila/sim/simulate.hpp"

namespace sila::python {
namespace {

/// As the scene file that `sila simulate` writes says it, so that both ways give the same frames.
DrawnScene drawn_scene_of(const IntersectionScene& simulated) {
  DrawnScene drawn{
      scene_of(simulated),
      {{"sidewalks", simulated.sidewalks}, {"crosswalks", simulated.crosswalks}, {"buildings", simulated.buildings}}};
  for (auto& [name, f, widths] : drawn.scene.corners)
    f = make_curb_frame(f.origin_m, f.axis_1, f.axis_2, f.sidewalk_width_m);
  return drawn;
}

std::tuple<std::vector<Track>, std::vector<Track>, DrawnScene> simulate_tracks(const std::string& config_json) {
  Simulation simulation = simulate(config_of(config_json).simulate);
  return {tracks_of(std::move(simulation.tracks)), tracks_of(std::move(simulation.truth)),
          drawn_scene_of(simulation.scene)};
}

}  // namespace

void bind_sim(nb::module_& module) {
  module.def("simulate", &simulate_tracks, "config"_a, nb::call_guard<nb::gil_scoped_release>(),
             "Tracks as a tracker reports them, the truth behind them, and the scene.");
}

}  // namespace sila::python
