#include "arrays.hpp"
#include "sila/core/counted.hpp"
#include "sila/io/model_file.hpp"
#include "sila/io/reports.hpp"
#include "sila/model/packing.hpp"

namespace sila::python {
namespace {

/// A primitive with the grid that its cells are of.
struct Primitive {
  MotionPrimitive content;
  Grid grid;
};

std::vector<Primitive> primitives_of(const StoredModel& stored) {
  const Grid& grid = stored.model.settings.grid;
  return list_of(stored.model.primitives, [&](const MotionPrimitive& content) { return Primitive{content, grid}; });
}

std::map<int, double> by_site(const Transition& transition) {
  std::map<int, double> counts;
  for (const SiteCount& part : transition.sites) counts[part.site] = part.count;
  return counts;
}

/// Without the GPs, which are not for users.
std::vector<Transition> transitions_of(const StoredModel& stored) {
  return list_of(stored.model.transitions,
                 [](const Transition& t) { return Transition{t.from, t.to, t.count, {}, t.sites, t.support}; });
}

nb::ndarray<nb::numpy, std::int32_t, nb::c_contig> cells_of(const Primitive& primitive) {
  std::vector<std::int32_t> numbers;
  for (const CellVelocity& entry : primitive.content.cells) numbers.insert(numbers.end(), {entry.cell.x, entry.cell.y});
  return array_of(std::move(numbers), {primitive.content.cells.size(), 2});
}

std::vector<Vector2> centres_of(const Primitive& primitive) {
  return list_of(primitive.content.cells,
                 [&](const CellVelocity& entry) { return centre_of(primitive.grid, entry.cell); });
}

nlohmann::ordered_json history_of(const StoredModel& stored) {
  nlohmann::ordered_json history = nlohmann::ordered_json::array();
  for (const EpisodeRecord& e : stored.episodes) {
    history.push_back(record_json(e));
    history.back().update(nlohmann::ordered_json::parse(e.statistics));
  }
  return history;
}

/// JSON as Python's own dictionaries and lists.
nb::object in_python(const std::string& json) {
  return nb::module_::import_("json").attr("loads")(json);
}

std::string repr(const StoredModel& stored) {
  const Model& model = stored.model;
  return "Model(size=" + std::to_string(size(model)) + ": " + counted(model.primitives.size(), "primitive") + ", " +
         counted(model.transitions.size(), "transition") + "; " + counted(model.tracks, "track") + " in " +
         counted(model.episodes, "episode") + ")";
}

void bind_parts(nb::module_& module) {
  nb::class_<Primitive>(module, "Primitive", "A motion primitive: arrows in cells of the curb grid.")
      .def_prop_ro("cells", &cells_of, nb::rv_policy::automatic,
                   "Shape (n, 2), int32: integer coordinates of the cells.")
      .def_prop_ro(
          "centres", [](const Primitive& p) { return array_of_points(centres_of(p)); }, nb::rv_policy::automatic,
          "Shape (n, 2), curb coordinates of the cells' centres.")
      .def_prop_ro(
          "velocities",
          [](const Primitive& p) { return array_of_points(list_of(p.content.cells, &CellVelocity::velocity)); },
          nb::rv_policy::automatic, "Shape (n, 2): the arrows, of length at most 1.")
      .def_prop_ro(
          "weight", [](const Primitive& p) { return p.content.weight; },
          "Number of primitives that were fused into it.")
      .def("__len__", [](const Primitive& p) { return p.content.cells.size(); })
      .def("__repr__", [](const Primitive& p) {
        return nb::str("Primitive({} cells, weight={:g})").format(p.content.cells.size(), p.content.weight);
      });
  nb::class_<Transition>(module, "Transition", "A transition from one primitive to another, or to itself.")
      .def_ro("from_primitive", &Transition::from, "Index in Model.primitives.")
      .def_ro("to_primitive", &Transition::to, "Index in Model.primitives.")
      .def_ro("count", &Transition::count, "Number of tracks that showed it.")
      .def_prop_ro("sites", &by_site, "A dictionary from index in Model.sites to count.")
      .def("__repr__", [](const Transition& t) {
        return nb::str("Transition({} -> {}, count={:g})").format(t.from, t.to, t.count);
      });
  nb::class_<Site>(module, "Site", "A place where a model was trained.")
      .def_ro("frame", &Site::frame, "The curb frame that it is known by.")
      .def_ro("episodes", &Site::episodes, "Batches that had tracks of it.")
      .def_ro("tracks", &Site::tracks, "Tracks of it that were learnt.")
      .def("__repr__",
           [](const Site& s) { return nb::str("Site({} tracks in {} episodes)").format(s.tracks, s.episodes); });
}

/// A path that has a name: an empty text is a mistake that the system reports badly.
const std::filesystem::path& named(const char* verb, const std::filesystem::path& path) {
  if (path.empty())
    throw std::invalid_argument(std::string(verb) + ": path: expected a file name, found an empty text");
  return path;
}

}  // namespace

std::vector<std::string> texts_of(const std::vector<EpisodeId>& ids) {
  return list_of(ids, [](const EpisodeId& id) { return to_text(id); });
}

void bind_model(nb::module_& module) {
  bind_parts(module);
  nb::class_<StoredModel>(module, "Model",
                          "A model of one or several sites, with the configuration that it was learnt with and the "
                          "records of its episodes.\n\n"
                          "Model() knows nothing. Values do not change: `learn` and `fuse` give new models.")
      .def(nb::init<>())
      .def_static(
          "load", [](const std::filesystem::path& path) { return load_model(named("Model.load", path)); }, "path"_a,
          nb::call_guard<nb::gil_scoped_release>(),
          "Reads a model file. Raises FormatError if it is missing, damaged or no model.")
      .def(
          "save",
          [](const StoredModel& stored, const std::filesystem::path& path) {
            save_model(named("Model.save", path), stored);
          },
          "path"_a, nb::call_guard<nb::gil_scoped_release>(),
          "Writes a model file. Raises FormatError if the path has a file that is not a model.")
      .def_prop_ro(
          "size", [](const StoredModel& stored) { return size(stored.model); },
          "The paper's model size: primitives and transitions.")
      .def_prop_ro(
          "tracks", [](const StoredModel& stored) { return stored.model.tracks; }, "Tracks learnt from.")
      .def_prop_ro(
          "episodes", [](const StoredModel& stored) { return stored.model.episodes; }, "Batches learnt.")
      .def_prop_ro(
          "prior_windows", [](const StoredModel& stored) { return windows_in(stored.model.refinement.prior.density); },
          "Windows at other places that it began with (`make_prior`).")
      .def_prop_ro(
          "episode_ids", [](const StoredModel& stored) { return texts_of(stored.model.episode_ids); },
          "Ids of the learnt batches, by their content, sorted: a batch that is among them is not learnt again.")
      .def_prop_ro(
          "reference_width_m", [](const StoredModel& stored) { return stored.model.settings.reference_width_m; },
          "Metres of one curb unit; to be fused, models need the same.")
      .def_prop_ro(
          "sites", [](const StoredModel& stored) { return stored.model.sites; },
          "A list of Site, in the order of training.")
      .def_prop_ro("primitives", &primitives_of, "A list of Primitive.")
      .def_prop_ro("transitions", &transitions_of, "A list of Transition, sorted by from_primitive and to_primitive.")
      .def_prop_ro(
          "cell_widths", [](const StoredModel& stored) { return stored.model.settings.grid.cell; },
          "Side of a grid cell in curb units.")
      .def_prop_ro(
          "sample_interval_s", [](const StoredModel& stored) { return stored.model.settings.sample_interval_s; },
          "Seconds between resampled positions.")
      .def_prop_ro(
          "config_json", [](const StoredModel& stored) { return stored.configuration; }, "`config` as JSON text.")
      .def_prop_ro(
          "config", [](const StoredModel& stored) { return in_python(stored.configuration); },
          nb::for_getter(nb::sig("def config(self, /) -> dict[str, typing.Any]")),
          "The configuration that it was learnt with, as a nested dictionary.")
      .def_prop_ro(
          "history", [](const StoredModel& stored) { return in_python(history_of(stored).dump()); },
          nb::for_getter(nb::sig("def history(self, /) -> list[dict[str, typing.Any]]")),
          "What each episode did: number, tracks, seconds, size_before, size_after and more.")
      .def(
          "inspect", [](const StoredModel& stored) { return in_python(inspect_json(stored).dump()); },
          nb::sig("def inspect(self) -> dict[str, typing.Any]"), "What `sila inspect --json` prints.")
      .def(
          "describe", [](const StoredModel& stored) { return describe(stored); }, "A dozen lines for people.")
      .def(
          "__eq__", [](const StoredModel& a, const StoredModel& b) { return identical(a.model, b.model); },
          "Whether two models are the same bit for bit, whenever and with whatever names they were learnt.")
      .def(
          "__eq__", [](const StoredModel&, nb::handle) { return false; }, nb::arg().none())
      .def("__repr__", &repr)
      .def("__copy__", [](const StoredModel& stored) { return stored; })
      .def("__deepcopy__", [](const StoredModel& stored, const nb::dict&) { return stored; })
      .def("__getstate__",
           [](const StoredModel& stored) {
             const std::string bytes = model_bytes(stored);  // one format, bit for bit, versioned
             return nb::make_tuple(nb::bytes(bytes.data(), bytes.size()));
           })
      .def("__setstate__", [](StoredModel& stored, const nb::tuple& state) {
        const auto bytes = nb::cast<nb::bytes>(state[0]);
        new (&stored) StoredModel(model_of_bytes({bytes.c_str(), bytes.size()}));
      });
}

}  // namespace sila::python
