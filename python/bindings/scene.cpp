#include "sila/io/scene.hpp"

#include "arrays.hpp"
#include "sila/io/model_file.hpp"

namespace sila::python {
namespace {

constexpr const char* kYAxes[] = {"up", "down"};

DrawnScene load_scene(const std::filesystem::path& path, const std::filesystem::path& data_dir) {
  return {read_scene(path, data_dir), {}};
}

DrawnScene make_scene(nb::handle origin_m, nb::handle axis_1, nb::handle axis_2, double sidewalk_width_m,
                      std::optional<double> width_1_m, std::optional<double> width_2_m, const std::string& name,
                      const std::string& y_axis) {
  const SidewalkWidths widths{sidewalk_width_m, width_1_m.value_or(sidewalk_width_m),
                              width_2_m.value_or(sidewalk_width_m)};
  const Vector2 first = pair_from("axis_1", axis_1), second = pair_from("axis_2", axis_2);
  DrawnScene drawn;
  drawn.scene.name = name;
  drawn.scene.y_axis = value_named<YAxis>("Scene: y_axis", kYAxes, y_axis);
  drawn.scene.corners = {
      {"1", make_curb_frame(pair_from("origin", origin_m), first, second, sidewalk_width_m), widths}};
  validate(drawn.scene);
  drawn.scene.warnings = mirrored_axes(drawn.scene);
  return drawn;
}

using FileState =
    std::tuple<std::string, std::string, std::optional<std::string>, std::optional<double>, std::optional<double>,
               std::optional<double>, std::array<double, 4>, std::vector<std::string>>;
using CameraState = std::optional<std::array<double, 9>>;
using CornerState = std::tuple<std::string, std::array<double, 3>, FrameState>;
using PolygonState = std::vector<std::pair<double, double>>;

FileState state_of(const SceneFile& file) {
  std::optional<std::string> format;
  const ReadOptions& options = file.options;
  if (options.format) format = std::string(name_of(*options.format));
  const SimilarityTransform& s = file.to_scene;
  return FileState(file.path, file.resolved.string(), format, options.frames_per_second, options.sample_interval_s,
                   options.metres_per_unit, {s.a, s.b, s.tx, s.ty}, options.person_classes);
}

SceneFile file_in(const FileState& state) {
  const auto& [path, resolved, format, rate, interval, scale, transform, classes] = state;
  const auto [a, b, tx, ty] = transform;
  return {path,
          resolved,
          {format ? track_format(*format) : std::nullopt, rate, interval, scale, std::nullopt, classes},
          {a, b, tx, ty}};
}

CameraState state_of(const std::optional<Camera>& camera) {
  if (!camera) return std::nullopt;
  std::array<double, 9> numbers;
  Eigen::Map<Eigen::Matrix3d>(numbers.data()) = camera->ground_from_image;
  return numbers;
}

std::optional<Camera> camera_in(const CameraState& state) {
  if (!state) return std::nullopt;
  return Camera{Eigen::Map<const Eigen::Matrix3d>(state->data())};
}

nb::tuple state_of(const Scene& scene) {
  std::vector<CornerState> corners;
  for (const Corner& corner : scene.corners) {
    const SidewalkWidths& w = corner.widths;
    corners.push_back({corner.name, {w.mean_m, w.width_1_m, w.width_2_m}, python::state_of(corner.frame)});
  }
  const auto files = list_of(scene.files, [](const SceneFile& file) { return state_of(file); });
  const auto searched = list_of(scene.searched, [](const std::filesystem::path& folder) { return folder.string(); });
  return nb::make_tuple(scene.name, scene.path.string(), scene.y_axis == YAxis::down, corners, scene.primary, files,
                        searched, scene.warnings, state_of(scene.camera));
}

Scene scene_in(const nb::tuple& state) {
  Scene scene;
  scene.name = nb::cast<std::string>(state[0]);
  scene.path = nb::cast<std::string>(state[1]);
  scene.y_axis = nb::cast<bool>(state[2]) ? YAxis::down : YAxis::up;
  for (const auto& [name, widths, frame] : nb::cast<std::vector<CornerState>>(state[3]))
    scene.corners.push_back({name, frame_in(frame), {widths[0], widths[1], widths[2]}});
  scene.primary = nb::cast<std::size_t>(state[4]);
  for (const FileState& file : nb::cast<std::vector<FileState>>(state[5])) scene.files.push_back(file_in(file));
  for (const std::string& folder : nb::cast<std::vector<std::string>>(state[6])) scene.searched.push_back(folder);
  scene.warnings = nb::cast<std::vector<std::string>>(state[7]);
  scene.camera = camera_in(nb::cast<CameraState>(state[8]));
  if (scene.primary >= scene.corners.size()) throw std::invalid_argument("Scene: primary is not an index of corners");
  return scene;
}

nb::tuple state_of(const DrawnScene& drawn) {
  std::map<std::string, std::vector<PolygonState>> layers;
  for (const auto& [name, polygons] : drawn.layers) {
    for (const std::vector<Vector2>& polygon : polygons) {
      PolygonState& points = layers[name].emplace_back();
      for (const Vector2& point : polygon) points.emplace_back(point.x(), point.y());
    }
  }
  return nb::make_tuple(state_of(drawn.scene), layers);
}

DrawnScene drawn_scene_in(const nb::tuple& state) {
  DrawnScene drawn{scene_in(nb::cast<nb::tuple>(state[0])), {}};
  for (const auto& [name, polygons] : nb::cast<std::map<std::string, std::vector<PolygonState>>>(state[1])) {
    for (const PolygonState& points : polygons) {
      std::vector<Vector2>& polygon = drawn.layers[name].emplace_back();
      for (const auto& [x, y] : points) polygon.emplace_back(x, y);
    }
  }
  return drawn;
}

std::map<std::string, std::vector<Array>> layers_of(const DrawnScene& scene) {
  std::map<std::string, std::vector<Array>> layers;
  for (const auto& [name, polygons] : scene.layers) {
    for (const std::vector<Vector2>& polygon : polygons) layers[name].push_back(array_of_points(polygon));
  }
  return layers;
}

CurbFrame frame_of(const DrawnScene& drawn, std::optional<std::size_t> corner, const std::string& scaling) {
  const std::vector<Corner>& corners = drawn.scene.corners;
  const std::size_t index = corner.value_or(drawn.scene.primary);
  if (index >= corners.size()) {
    throw std::invalid_argument("frame: corner = " + std::to_string(index) + ", the scene has " +
                                std::to_string(corners.size()));
  }
  return rescaled(corners[index].frame, value_named<CurbScaling>("frame: scaling", kCurbScalings, scaling));
}

/// The scene by which tracks are looked at: given, of the model, or made from the first batch of a new one.
DrawnScene scene_for_verb(const DrawnScene* given, const StoredModel& stored, const std::vector<Track>& tracks,
                          std::size_t batch, const std::string& config_json) {
  const auto first =
      without_frames(list_of(std::span(tracks).first(std::min(batch, tracks.size())), &Track::trajectory));
  if (given == nullptr && stored.model.sites.empty() && first.empty()) return {};  // nothing is to be looked at
  DrawnScene drawn = given == nullptr ? DrawnScene{} : *given;
  drawn.scene = scene_for(drawn.scene, stored.model, first, config_of(config_json).corners);
  return drawn;
}

}  // namespace

std::vector<FramedTrajectory> placed(const std::vector<Track>& tracks, const DrawnScene& drawn, const Config& config) {
  std::vector<FramedTrajectory> result = without_frames(list_of(tracks, &Track::trajectory));
  place(result, drawn.scene, config.corners, config.episode.scaling);
  return result;
}

void bind_scene(nb::module_& module) {
  nb::class_<DrawnScene>(module, "Scene",
                         "A place: where its corners and their curbs are, and which files were recorded there.\n\n"
                         "origin: (2,) metres, where the straight curbs of the primary corner meet. axis_1, axis_2:\n"
                         "(2,) directions along its curbs, away from the corner. sidewalk_width_m: mean width;\n"
                         "sidewalk_width_1_m, sidewalk_width_2_m: those along axis_1 and axis_2. y_axis: up, or down\n"
                         "as in pictures. Raises ValueError for curbs that are nearly parallel or a width of zero.")
      .def(
          "__init__",
          [](DrawnScene* self, nb::handle origin, nb::handle axis_1, nb::handle axis_2, double width_m,
             std::optional<double> width_1_m, std::optional<double> width_2_m, const std::string& name,
             const std::string& y_axis) {
            new (self) DrawnScene(make_scene(origin, axis_1, axis_2, width_m, width_1_m, width_2_m, name, y_axis));
          },
          nb::kw_only(), "origin"_a, "axis_1"_a, "axis_2"_a, "sidewalk_width_m"_a, "sidewalk_width_1_m"_a = nb::none(),
          "sidewalk_width_2_m"_a = nb::none(), "name"_a = "", "y_axis"_a = "up",
          nb::sig("def __init__(self, *, origin: numpy.typing.ArrayLike, axis_1: numpy.typing.ArrayLike, "
                  "axis_2: numpy.typing.ArrayLike, sidewalk_width_m: float, sidewalk_width_1_m: float | None = None, "
                  "sidewalk_width_2_m: float | None = None, name: str = '', y_axis: str = 'up') -> None"))
      .def_static(
          "load", &load_scene, "path"_a, nb::kw_only(), "data_dir"_a = std::filesystem::path(),
          "Reads a scene file; data_dir is also searched for the files that it names. Raises FormatError, which names\n"
          "the field.")
      .def_static(
          "of_model",
          [](const StoredModel& stored) {
            return DrawnScene{scene_of(stored.model), {}};
          },
          "model"_a,
          "The sites of a model as corners, as `sila scene show` prints them. Raises ValueError for an empty model.")
      .def(
          "save", [](const DrawnScene& drawn, const std::filesystem::path& path) { write_scene(path, drawn.scene); },
          "path"_a, "Writes what `load` reads.")
      .def_prop_ro("name", [](const DrawnScene& drawn) { return drawn.scene.name; })
      .def_prop_ro(
          "corners", [](const DrawnScene& drawn) { return list_of(drawn.scene.corners, &Corner::name); },
          "The names of the corners.")
      .def_prop_ro(
          "primary", [](const DrawnScene& drawn) { return drawn.scene.primary; }, "Index of the primary corner.")
      .def_prop_ro("y_axis", [](const DrawnScene& drawn) { return drawn.scene.y_axis == YAxis::up ? "up" : "down"; })
      .def_prop_ro(
          "files", [](const DrawnScene& drawn) { return list_of(drawn.scene.files, &SceneFile::path); },
          "The track files that the scene names.")
      .def_prop_ro("warnings", [](const DrawnScene& drawn) { return drawn.scene.warnings; })
      .def_prop_ro(
          "layers", &layers_of, nb::rv_policy::automatic,
          "What there is to draw, by name (sidewalks, crosswalks, buildings): polygons of shape (n, 2), metres.")
      .def("frame", &frame_of, nb::kw_only(), "corner"_a = nb::none(), "scaling"_a = kCurbScalings[0],
           "The CurbFrame of the corner with this index, or of the primary one. scaling: metres or mean_width. Raises\n"
           "ValueError for another index or scaling.")
      .def("__eq__", [](const DrawnScene& a, const DrawnScene& b) { return state_of(a).equal(state_of(b)); })
      .def(
          "__eq__", [](const DrawnScene&, nb::handle) { return false; }, nb::arg().none())
      .def("__repr__",
           [](const DrawnScene& scene) {
             return nb::str("Scene('{}', {} corners, {} files)")
                 .format(scene.scene.name, scene.scene.corners.size(), scene.scene.files.size());
           })
      .def("__getstate__", [](const DrawnScene& scene) { return state_of(scene); })
      .def("__setstate__",
           [](DrawnScene& scene, const nb::tuple& state) { new (&scene) DrawnScene(drawn_scene_in(state)); });
  module.def(
      "warning_of_moved_corner",
      [](const StoredModel& stored, const DrawnScene& drawn) {
        return warning_of_moved_corner(stored.model, drawn.scene);
      },
      "model"_a, "scene"_a, "A sentence if a corner of the scene may be a moved site of the model; else empty.");
  module.def(
      "scene_for", &scene_for_verb, "given"_a.none(), "model"_a, "tracks"_a, "batch"_a, "config"_a,
      nb::call_guard<nb::gil_scoped_release>(),
      "The scene by which tracks are looked at: given, of the model, or made from the first batch of a new one.");
}

}  // namespace sila::python
