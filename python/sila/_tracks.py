"""Tracks, and the other forms of tracks that functions accept."""

from __future__ import annotations

import atexit
import io
import json
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import NDArray

from . import _sila
from ._config import ConfigLike, merged
from ._rows import Items, Rows, counted, file_named, floats_of, names_of, number, rows_of_frame, text_of, warn, whole
from ._sila import Scene, Track
from .errors import FormatError

if TYPE_CHECKING:
    import pandas

#: Whatever tracks can be given as: see `as_tracks`.
TracksLike = Union["Tracks", "pandas.DataFrame", Mapping[Any, Any], Iterable[Any], str, "os.PathLike[str]"]
SceneLike = Union[Scene, str, "os.PathLike[str]"]
_ARRAYS = "arrays"  #: the source of their rows
#: The last scene whose warnings were shown.
_warned: Scene | None = None


class Tracks(Items[Track]):
    """Tracks, and a report of the rows that they were made of. A slice, a mask or a list of indices gives Tracks."""

    _type = Track

    def __init__(self, tracks: Iterable[Track] = (), *, report: Mapping[str, Any] | None = None) -> None:
        super().__init__(tracks)
        #: Counts of rows and tracks, dropped rows by reason, warnings.
        self.report: dict[str, Any] = dict(report or {})

    def __add__(self, other: Tracks) -> Tracks:
        """Tracks keep the numbers of their recordings; to join recordings, read their files by one `read_tracks`."""
        return Tracks([*self, *other])

    def __repr__(self) -> str:
        samples = sum(map(len, self))
        return f"Tracks({counted(len(self), 'track')}, {counted(samples, 'sample')})"

    def to_frame(self) -> pandas.DataFrame:
        """A data frame with the columns track_id, t [s], x, y [m], one row a sample."""
        import pandas

        self._check_one_table("to_frame")
        lengths = [len(track) for track in self]
        xy = _stacked([track.positions_m for track in self], 2)
        return pandas.DataFrame(
            {
                "track_id": np.repeat(np.array([track.id for track in self], dtype=object), lengths),
                "t": _stacked([track.times_s for track in self], 1),
                "x": xy[:, 0],
                "y": xy[:, 1],
            }
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a CSV with the header track_id,t,x,y; every number reads back as the same double."""
        self._check_one_table("save")
        _sila.write_csv(Path(path), self._items)

    def _check_one_table(self, verb: str) -> None:
        """Two tracks under one id would be read as one person, and all tracks as of one recording."""
        counts = Counter(track.id for track in self)
        twice = next((name for name, count in counts.items() if count > 1), None)
        if twice is not None:
            raise ValueError(f"Tracks.{verb}: expected different ids, found {twice!r} twice; write recordings apart")
        spans: dict[int, tuple[float, float]] = {}
        for track in self:
            begin, end = spans.get(track.recording, (np.inf, -np.inf))
            spans[track.recording] = min(begin, track.times_s[0]), max(end, track.times_s[-1])
        if any(second[0] <= first[1] for first, second in pairwise(sorted(spans.values()))):
            warn([f"Tracks.{verb}: recordings that overlap in time become one, with companions; write recordings apart"])


def read_tracks(
    paths: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] | pandas.DataFrame | None = None,
    *,
    scene: SceneLike | None = None,
    format: str | None = None,
    frames_per_second: float | None = None,
    metres_per_unit: float | None = None,
    camera: str | os.PathLike[str] | None = None,
    person_classes: str | Sequence[str] = (),
    config: ConfigLike = None,
) -> Tracks:
    """Reads track files or folders; without `paths`, the files that `scene` names. Formats are recognised by content. A data
    frame is taken as by `as_tracks`: seconds and metres; of the options `person_classes` and `config` apply to it.

    `camera`: a file with the camera by which pixels become metres, instead of that of the scene. `person_classes`: the
    class names or numbers that are pedestrians (or one), instead of the usual ones (docs/formats.md). Files that the scene
    names get the units and the transform that it says. `config`: the group `clean` is used.
    Units that look wrong are a UserWarning, and in the `report`.
    Raises FormatError for a file that is missing, damaged, of no known format or without a usable track.
    """
    place = None if scene is None else as_scene(scene)
    if hasattr(paths, "columns"):
        given: dict[str, Any] = {"format": format, "frames_per_second": frames_per_second, "camera": camera}
        unused = [name for name, value in (given | {"metres_per_unit": metres_per_unit}).items() if value is not None]
        if unused:
            raise ValueError(f"read_tracks: {', '.join(unused)}: for files; a data frame has seconds and metres")
        rows = rows_of_frame(paths, person_classes=names_of(person_classes))
        return clean_rows(*rows, "data frame", merged("{}", config))
    if paths is None and (place is None or not place.files):
        raise ValueError("read_tracks: expected paths, or a scene that names its files; found neither")
    files = _files(paths)
    tracks, text = _sila.read_files(
        files,
        place,
        None if format is None else str(format),
        None if frames_per_second is None else number("frames_per_second", frames_per_second),
        None if metres_per_unit is None else number("metres_per_unit", metres_per_unit),
        None if camera is None else file_named("camera", camera),
        names_of(person_classes),
        merged("{}", config),
    )
    report = json.loads(text)
    warn(report["warnings"])
    return Tracks(tracks, report=report)


def _files(paths: Any) -> list[Path]:
    if paths is None:
        return []
    several = [paths] if isinstance(paths, (str, os.PathLike)) else listed(paths)
    if not isinstance(several, Iterable):
        raise TypeError(f"read_tracks: paths: expected paths or a data frame, found {type(paths).__name__}")
    files = list(several)
    if not files:
        raise ValueError("read_tracks: paths: expected at least one path, found 0")
    different = set()
    for file in files:
        if not isinstance(file, (str, os.PathLike)):
            raise TypeError(f"read_tracks: paths: expected paths, found {type(file).__name__} among them")
        if (real := os.path.realpath(file)) in different:
            raise ValueError(f"read_tracks: paths: expected each file once, found {os.fspath(file)} twice")
        different.add(real)
    return [Path(file) for file in files]


def split_tracks(
    tracks: TracksLike, *, test_share: float = 0.2, seed: int = 1, by: str = "time"
) -> tuple[Tracks, Tracks]:
    """Holds back a share of the people: (to learn from, held back). Tracklets of one person stay on one side.

    by: "time" holds back a block of time and leaves out all others who were there within 5 s of a held-back person,
    as companions walk alike; "track" holds back people at random.
    Raises ValueError if a side has no track, and by time for a recording whose tracks all begin at one instant: it has
    no common clock.
    """
    given = list(as_tracks(tracks))
    seed, test_share = whole("split_tracks: seed", seed, 0, 2**64 - 1), number("split_tracks: test_share", test_share)
    train, test = _sila.split_tracks(given, test_share, seed, str(by))
    if not train or not test:
        raise ValueError(
            f"split_tracks: expected tracks on both sides, found {len(train)} to learn from and {len(test)} held back "
            f"of {len(given)}; give more tracks, or another test_share or seed"
        )
    return Tracks(train), Tracks(test)


def listed(tracks: Any) -> Any:
    """An iterator, which can be read once, as a list; all else as it is."""
    if isinstance(tracks, io.IOBase):
        raise TypeError(f"tracks: expected the path of a file, found an open file ({type(tracks).__name__})")
    return list(tracks) if isinstance(tracks, Iterator) else tracks


@atexit.register
def _forget_warned() -> None:  # nanobind reports objects that outlive the interpreter
    global _warned
    _warned = None


def as_scene(scene: Any) -> Scene:
    """A scene, or the path of a scene file. Shows its warnings, once although a call may come here several times."""
    global _warned
    if isinstance(scene, (str, os.PathLike)):
        scene = Scene.load(Path(scene))
    if not isinstance(scene, Scene):
        raise TypeError(f"scene: expected a sila.Scene or the path of a scene file, found {type(scene).__name__}")
    if scene.warnings and scene is not _warned:
        _warned = scene
        warn(scene.warnings)
    return scene


def as_tracks(
    tracks: TracksLike,
    *,
    scene: SceneLike | None = None,
    frames_per_second: float | None = None,
    config: ConfigLike = None,
) -> Tracks:
    """Tracks from any accepted form:

    - `Tracks`, a `Track`, or any sequence of `Track`;
    - a pandas data frame with the columns track_id, t [s, or dates], x, y [m] (and label, or another name of
      the class that files may have);
    - a dictionary from id to an array of shape (n, 3) with the columns t, x, y, or to a data frame with columns of these
      names; or a sequence of such arrays or frames, whose ids are then their numbers from 0;
    - the path of a track file, or several.

    Rows are cleaned as those of a file are; `config`: the group `clean` is used. Files get the camera, the units and the
    transform of the `scene`; everything else is in metres, in its frame. `frames_per_second` is for files with frame numbers.
    """
    scene = None if scene is None else as_scene(scene)
    tracks = listed(tracks)
    if frames_per_second is not None and not _are_files(tracks):
        raise ValueError("frames_per_second: expected files, which may have frame numbers; other tracks have seconds")
    if isinstance(tracks, Tracks):
        return tracks
    if isinstance(tracks, Track):
        return Tracks([tracks])
    if isinstance(tracks, (str, os.PathLike)) or hasattr(tracks, "columns"):
        return read_tracks(tracks, scene=scene, frames_per_second=frames_per_second, config=config)
    if isinstance(tracks, Mapping):
        return clean_rows(*_rows_of_arrays(list(tracks.items())), _ARRAYS, merged("{}", config))
    if isinstance(tracks, np.ndarray) and tracks.dtype != object and tracks.ndim != 3:
        raise ValueError(
            "tracks: expected a list or a dictionary of arrays of shape (n, 3), "
            f"found one array of shape {tracks.shape}; put it in a list"
        )
    try:
        entries = list(tracks)
    except TypeError:
        raise TypeError(
            f"tracks: expected tracks, a data frame, a dictionary of arrays or a path; found {type(tracks).__name__}"
        ) from None
    if all(isinstance(entry, Track) for entry in entries):
        return Tracks(entries)
    if all(isinstance(entry, (str, os.PathLike)) for entry in entries):
        return read_tracks(entries, scene=scene, frames_per_second=frames_per_second, config=config)
    return clean_rows(*_rows_of_arrays(list(enumerate(entries))), _ARRAYS, merged("{}", config))


def _are_files(tracks: Any) -> bool:
    several = tracks if isinstance(tracks, (list, tuple)) else [tracks]
    return all(isinstance(file, (str, os.PathLike)) for file in several)


def clean(reported: Tracks, source: str, settings: str) -> Tracks:
    """Tracks as they would be if they were read from a file; rejects rows of which not one track is left."""
    ids = [track.input_id for track in reported for _ in range(len(track))]
    t = _stacked([track.times_s for track in reported], 1)
    xy = _stacked([track.positions_m for track in reported], 2)
    return clean_rows(ids, t, xy, [], source, settings)


def clean_rows(
    ids: list[str], t: NDArray[np.float64], xy: NDArray[np.float64], labels: list[str], source: str, settings: str
) -> Tracks:
    """Rows to tracks; rows without an id are dropped. Raises FormatError, as for a file, if there are rows and not one
    track is left."""
    nameless = [row for row, name in enumerate(ids) if not name]
    if nameless and len(nameless) == len(ids):
        raise FormatError(source, 0, "rows with an id (track_id)", f"none in {counted(len(ids), 'row')}")
    if nameless:
        named = np.delete(np.arange(len(ids)), nameless)
        ids, t, xy, labels = [name for name in ids if name], t[named], xy[named], [labels[i] for i in named if labels]
    tracks, text = _sila.clean_rows(ids, t, xy, labels, source, settings)
    report = json.loads(text)
    if nameless:
        report["rows_read"] += len(nameless)
        report["dropped"]["missing_cells"] = {"rows": len(nameless), "first": f"{source}, row {nameless[0]} (from 0)"}
    if source == _ARRAYS:
        report["warnings"] += _doubts(report)
    if report["rows_read"] and not tracks:
        found = "; ".join([_reasons(report["dropped"]), *report["warnings"]])
        raise FormatError(source, 0, "at least one track of two samples", found)
    warn(report["warnings"])
    return Tracks(tracks, report=report)


def _doubts(report: Mapping[str, Any]) -> list[str]:
    """Whether arrays, which do not name their columns, have them in another order."""
    dropped = sum(entry["rows"] for reason, entry in report["dropped"].items() if reason != "other_label")
    unordered, jumps = report["out_of_order_rows"], report["splits_at_jumps"]
    if 2 * (dropped + unordered + jumps) <= report["rows_read"]:
        return []
    found = f"{dropped} dropped, {unordered} out of order, {jumps} after a jump"
    return [f"tracks: of {counted(report['rows_read'], 'row')} {found}; are the columns t, x, y?"]


def _reasons(dropped: Mapping[str, Any]) -> str:
    counts = {_sila.DROP_REASONS[reason]: entry["rows"] for reason, entry in dropped.items()}
    return "; ".join(f"dropped rows that {text}: {rows}" for text, rows in counts.items())


def _rows_of_arrays(entries: list[tuple[Any, Any]]) -> Rows:
    rows: list[NDArray[np.float64]] = [np.empty((0, 3))]
    ids: list[str] = []
    labels: list[str] = []
    keys: dict[str, Any] = {}
    for key, value in entries:
        name = text_of(key)
        if name and name in keys:
            raise ValueError(f"tracks: expected keys of different text, found {keys[name]!r} and {key!r}")
        keys[name] = key
        classes: list[str] = []
        if hasattr(value, "columns"):
            if "track_id" in value and len(set(value["track_id"])) > 1:
                raise ValueError(f"tracks[{key!r}]: expected one track, found several track_id; give one table of all")
            _, t, xy, classes = rows_of_frame(value, key)
            value = np.column_stack([t, xy])
        try:
            array = floats_of(value)
        except (TypeError, ValueError):
            raise TypeError(
                f"tracks[{key!r}]: expected numbers of shape (n, 3), found {type(value).__name__}"
            ) from None
        if array.ndim != 2 or array.shape[1] != 3:
            raise ValueError(f"tracks[{key!r}]: expected shape (n, 3) with the columns t, x, y; found {array.shape}")
        rows.append(array)
        ids += [name] * len(array)
        labels += classes or [""] * len(array)
    table = np.concatenate(rows)
    return ids, table[:, 0], table[:, 1:], labels


def _stacked(arrays: list[Any], dimensions: int) -> NDArray[np.float64]:
    empty = np.empty((0, 2) if dimensions == 2 else (0,))
    return np.concatenate([empty, *arrays])
