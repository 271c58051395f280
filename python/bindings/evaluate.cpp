#include "sila/evaluate/evaluate.hpp"

#include "arrays.hpp"
#include "experiments.hpp"
#include "sila/io/model_file.hpp"
#include "sila/io/reports.hpp"

namespace sila::python {
namespace {

/// The numbers as JSON, those of every window as JSON, the text for people, and a warning if tracks were learnt.
std::array<std::string, 4> evaluate_stored(const StoredModel& stored, const std::vector<Track>& tracks,
                                           const DrawnScene& scene, const std::string& config_json, int threads) {
  const ThreadLimit limit(threads);
  const Config config = config_of(config_json);
  const std::vector<FramedTrajectory> framed = placed(tracks, scene, config);
  const Evaluation evaluation = evaluate(stored.model, framed, config.episode, config.evaluate);
  return {to_json(evaluation).dump(), windows_json(evaluation), to_text(evaluation), warning_of_learnt(stored, framed)};
}

}  // namespace

void bind_eval(nb::module_& module) {
  module.def("evaluate", &evaluate_stored, "model"_a, "tracks"_a, "scene"_a, "config"_a, "threads"_a,
             nb::call_guard<nb::gil_scoped_release>());
  module.def(
      "modified_hausdorff_m",
      [](nb::handle a, nb::handle b) {
        return modified_hausdorff_m(finite_points_from("a", a), finite_points_from("b", b));
      },
      "a"_a, "b"_a, nb::sig("def modified_hausdorff_m(a: numpy.typing.ArrayLike, b: numpy.typing.ArrayLike) -> float"),
      "Modified Hausdorff distance [m] of two paths of shapes (n, 2) and (k, 2), metres. Raises ValueError for an "
      "empty path.");
}

}  // namespace sila::python
