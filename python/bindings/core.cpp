#include <nlohmann/json.hpp>

#include "arrays.hpp"
#include "sila/core/clean.hpp"
#include "sila/io/scene_tracks.hpp"
#include "sila/model/packing.hpp"

namespace sila::python {

FrameState state_of(const CurbFrame& frame) {
  return pack(frame);
}

CurbFrame frame_in(const FrameState& state) {
  const auto frame = unpack<CurbFrame>(state);
  validate(frame);
  return frame;
}

std::vector<Track> tracks_of(std::vector<Trajectory> trajectories, const std::vector<std::string>& input_ids) {
  std::vector<Track> tracks;
  for (Trajectory& trajectory : trajectories) {
    std::string input_id = input_ids.empty() ? trajectory.id : input_ids[tracks.size()];
    tracks.push_back({std::move(trajectory), std::move(input_id)});
  }
  return tracks;
}

namespace {

/// A text, or a whole number as text.
std::string id_from(nb::handle id) {
  if (std::string text; nb::isinstance<nb::str>(id)) {
    if (nb::try_cast(id, text)) return text;
    throw nb::value_error(("id: expected valid Unicode, found " + nb::cast<std::string>(nb::repr(id))).c_str());
  }
  if (!PyIndex_Check(id.ptr()) || PyBool_Check(id.ptr())) {
    const auto found = nb::cast<std::string>(nb::str(id.type().attr("__name__")));
    throw nb::type_error(("id: expected a text or a whole number, found " + found).c_str());
  }
  return nb::cast<std::string>(nb::str(nb::module_::import_("operator").attr("index")(id)));
}

Track make_track(const std::string& id, nb::handle times_s, nb::handle positions_m,
                 const std::optional<std::string>& input_id, std::size_t recording) {
  Track track{{id, numbers_from("times_s", times_s), points_from("positions_m", positions_m)}, input_id.value_or(id)};
  track.trajectory.recording = recording;
  validate(track.trajectory);
  return track;
}

void bind_track(nb::module_& module) {
  nb::class_<Track>(module, "Track",
                    "A time-stamped path in the world frame. Times increase strictly; everything is finite.\n\n"
                    "times_s: shape (n,), seconds. positions_m: shape (n, 2), metres.")
      .def(
          "__init__",
          [](Track* self, nb::handle id, nb::handle times_s, nb::handle positions_m,
             const std::optional<std::string>& input_id, std::size_t recording) {
            new (self) Track(make_track(id_from(id), times_s, positions_m, input_id, recording));
          },
          "id"_a, "times_s"_a, "positions_m"_a, nb::kw_only(), "input_id"_a = nb::none(), "recording"_a = 0,
          nb::sig("def __init__(self, id: str | int, times_s: numpy.typing.ArrayLike, positions_m: "
                  "numpy.typing.ArrayLike, *, input_id: str | None = None, recording: int = 0) -> None"),
          "input_id: as in the input, by default id. recording: tracks of one number have a common clock. Raises\n"
          "ValueError for shapes that differ, no sample, times that do not increase or numbers that are not finite.")
      .def_prop_ro(
          "id", [](const Track& track) { return track.trajectory.id; }, "Unique among the tracks read with it.")
      .def_prop_ro(
          "input_id", [](const Track& track) { return track.input_id; }, "The id that its rows had.")
      .def_prop_ro(
          "recording", [](const Track& track) { return track.trajectory.recording; },
          "Number of its recording, from 0; tracks of one recording have a common clock.")
      .def_prop_ro(
          "times_s", [](const Track& track) { return view_of(track.trajectory.times_s); },
          nb::rv_policy::reference_internal, "Shape (n,), seconds; a view that cannot be written.")
      .def_prop_ro(
          "positions_m", [](const Track& track) { return view_of(track.trajectory.positions_m); },
          nb::rv_policy::reference_internal, "Shape (n, 2), metres, world frame; a view that cannot be written.")
      .def("__len__", [](const Track& track) { return track.trajectory.times_s.size(); })
      .def("__eq__",
           [](const Track& a, const Track& b) {
             return a.trajectory.id == b.trajectory.id && a.input_id == b.input_id &&
                    a.trajectory.recording == b.trajectory.recording && a.trajectory.times_s == b.trajectory.times_s &&
                    a.trajectory.positions_m == b.trajectory.positions_m;
           })
      .def(
          "__eq__", [](const Track&, nb::handle) { return false; }, nb::arg().none())
      .def("__repr__",
           [](const Track& track) {
             const std::vector<double>& times = track.trajectory.times_s;
             return nb::str("Track('{}', {} samples, {:.1f} s)")
                 .format(track.trajectory.id, times.size(), times.back() - times.front());
           })
      .def("__getstate__",
           [](const Track& track) {
             return nb::make_tuple(track.trajectory.id, track.input_id,
                                   array_of(track.trajectory.times_s, {track.trajectory.times_s.size()}),
                                   array_of_points(track.trajectory.positions_m), track.trajectory.recording);
           })
      .def("__setstate__", [](Track& track, const nb::tuple& state) {
        new (&track) Track(make_track(nb::cast<std::string>(state[0]), state[2], state[3],
                                      nb::cast<std::string>(state[1]), nb::cast<std::size_t>(state[4])));
      });
}

/// All points of an array through one of the four maps of a frame.
template <Vector2 (*map)(const CurbFrame&, const Vector2&)>
auto mapped(const char* argument) {
  return [argument](const CurbFrame& frame, nb::handle given) {
    std::vector<Vector2> points = points_from(argument, given);
    for (Vector2& point : points) point = map(frame, point);
    return array_of_points(points);
  };
}

#define SILA_MAP_SIGNATURE(name, argument) \
  nb::sig("def " name "(self, " argument ": numpy.typing.ArrayLike) -> numpy.typing.NDArray[numpy.float64]")

void bind_frame(nb::module_& module) {
  nb::class_<CurbFrame>(
      module, "CurbFrame",
      "The common curbside frame of a corner: coordinates along its two curbs, in metres or in sidewalk widths.")
      .def_prop_ro(
          "origin_m", [](const CurbFrame& f) { return array_of_pair(f.origin_m); }, nb::rv_policy::automatic,
          "Shape (2,), metres: where the two straight curbs meet.")
      .def_prop_ro(
          "axes",
          [](const CurbFrame& f) {
            return array_of_points({f.axis_1, f.axis_2});
          },
          nb::rv_policy::automatic,
          "Shape (2, 2): a row is the unit vector of an axis, away from the corner. In metres the axes have a right "
          "angle\n"
          "and the bisector of the curbs, in sidewalk widths they are the directions of the curbs.")
      .def_prop_ro(
          "unit_m", [](const CurbFrame& f) { return array_of_pair(f.unit_m); }, nb::rv_policy::automatic,
          "Shape (2,): metres along each axis of one unit of the curb coordinates.")
      .def_ro("sidewalk_width_m", &CurbFrame::sidewalk_width_m)
      .def("to_curb", mapped<to_curb>("points_m"), "points_m"_a, SILA_MAP_SIGNATURE("to_curb", "points_m"),
           "World positions (n, 2) [m] to curb coordinates (n, 2) [curb units].")
      .def("to_world", mapped<to_world>("points"), "points"_a, SILA_MAP_SIGNATURE("to_world", "points"),
           "Curb coordinates (n, 2) [curb units] to world positions (n, 2) [m].")
      .def("velocity_to_curb", mapped<velocity_to_curb>("velocities_mps"), "velocities_mps"_a,
           SILA_MAP_SIGNATURE("velocity_to_curb", "velocities_mps"),
           "Velocities (n, 2) [m/s] to (n, 2) [curb units/s].")
      .def("velocity_to_world", mapped<velocity_to_world>("velocities"), "velocities"_a,
           SILA_MAP_SIGNATURE("velocity_to_world", "velocities"), "Velocities (n, 2) [curb units/s] to (n, 2) [m/s].")
      .def("__eq__", [](const CurbFrame& a, const CurbFrame& b) { return state_of(a) == state_of(b); })
      .def(
          "__eq__", [](const CurbFrame&, nb::handle) { return false; }, nb::arg().none())
      .def("__repr__",
           [](const CurbFrame& f) {
             return nb::str("CurbFrame(origin_m=({:.2f}, {:.2f}), sidewalk_width_m={:.2f})")
                 .format(f.origin_m.x(), f.origin_m.y(), f.sidewalk_width_m);
           })
      .def("__getstate__", [](const CurbFrame& f) { return state_of(f); })
      .def("__setstate__", [](CurbFrame& f, const FrameState& state) { new (&f) CurbFrame(frame_in(state)); });
}

/// Rows of a table: tracks and what became of the rows, as JSON.
std::pair<std::vector<Track>, std::string> clean_rows(const std::vector<std::string>& ids, nb::handle times_s,
                                                      nb::handle positions_m, const std::vector<std::string>& labels,
                                                      const std::string& source, const std::string& config) {
  const std::vector<double> times = numbers_from("t", times_s);
  const std::vector<Vector2> positions = points_from("x, y", positions_m);
  if (ids.size() != times.size() || ids.size() != positions.size() ||
      (!labels.empty() && labels.size() != ids.size())) {
    throw std::invalid_argument("clean_rows: track_id, t, x, y and label differ in length");
  }
  Detections detections{source, {}, ids.size()};
  for (std::size_t i = 0; i < ids.size(); ++i)
    detections.rows.push_back({ids[i], times[i], positions[i], labels.empty() ? std::string() : labels[i], 0});
  const Config settings = config_of(config);
  const nb::gil_scoped_release release;
  if (const auto camera = pixel_camera(settings)) {
    for (Detection& row : detections.rows) {
      if (row.position_m.allFinite()) row.position_m = to_ground(*camera, row.position_m).value();
    }
  }
  CleanTracks clean_tracks = clean(std::span(&detections, 1), settings.clean);
  return {tracks_of(std::move(clean_tracks.trajectories), clean_tracks.input_ids), to_json(clean_tracks.report).dump()};
}

}  // namespace

void bind_core(nb::module_& module) {
  bind_track(module);
  bind_frame(module);
  nb::dict reasons;  // why rows are in no track, as the program says it
  for (const DropReasonText& reason : kDropReasons)
    reasons[nb::str(reason.name.data(), reason.name.size())] = nb::str(reason.text.data(), reason.text.size());
  module.attr("DROP_REASONS") = reasons;
  module.def("clean_rows", &clean_rows, "ids"_a, "times_s"_a, "positions_m"_a, "labels"_a, "source"_a, "config"_a,
             "Rows to tracks: ids (n), times_s (n,), positions_m (n, 2); also a JSON text of what became of the rows.");
}

}  // namespace sila::python
