"""Tracks, and the other forms of tracks that functions accept."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union, overload

import numpy as np
from numpy.typing import NDArray

from . import _sila
from ._config import ConfigLike, merged
from ._sila import Scene, Track
from .errors import FormatError

if TYPE_CHECKING:
    import pandas

#: Whatever tracks can be given as: see `as_tracks`.
TracksLike = Union["Tracks", "pandas.DataFrame", Mapping[Any, Any], Iterable[Any], str, "os.PathLike[str]"]
SceneLike = Union[Scene, str, "os.PathLike[str]"]

_COLUMNS = ("track_id", "t", "x", "y")


class Tracks(Sequence[Track]):
    """Tracks and what became of the rows that they were made of. A slice, a mask or a list of indices gives Tracks."""

    def __init__(self, tracks: Iterable[Track] = (), *, report: Mapping[str, Any] | None = None) -> None:
        self._tracks = list(tracks)
        for track in self._tracks:
            if not isinstance(track, Track):
                raise TypeError(f"tracks: expected sila.Track, found {type(track).__name__}")
        #: Counts of rows and tracks, dropped rows by reason, warnings.
        self.report: dict[str, Any] = dict(report or {})

    def __len__(self) -> int:
        return len(self._tracks)

    def __iter__(self) -> Iterator[Track]:
        return iter(self._tracks)

    @overload
    def __getitem__(self, index: int) -> Track: ...
    @overload
    def __getitem__(self, index: slice) -> Tracks: ...
    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return Tracks(self._tracks[index])
        if np.ndim(index) == 0:
            return self._tracks[index]
        return Tracks(self._tracks[i] for i in np.arange(len(self))[np.asarray(index)])

    def __add__(self, other: Tracks) -> Tracks:
        return Tracks([*self, *other])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Tracks) and self._tracks == other._tracks

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        samples = sum(len(track) for track in self._tracks)
        return f"Tracks({len(self)} tracks, {samples} samples)"

    def to_frame(self) -> pandas.DataFrame:
        """A data frame with the columns track_id, t [s], x, y [m], one row a sample."""
        import pandas

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
        _sila.write_csv(Path(path), self._tracks)


def read_tracks(
    paths: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] | pandas.DataFrame | None = None,
    *,
    scene: SceneLike | None = None,
    format: str | None = None,
    frames_per_second: float | None = None,
    metres_per_unit: float | None = None,
    camera: str | os.PathLike[str] | None = None,
    person_classes: Sequence[str] = (),
    config: ConfigLike = None,
) -> Tracks:
    """Reads track files or folders; without `paths`, the files that `scene` names. Formats are recognised by content. A data
    frame is taken as by `as_tracks`: seconds and metres, without the options of files.

    `camera`: a file with the camera by which pixels become metres, instead of that of the scene. `person_classes`: the
    class names or numbers that are pedestrians, instead of the usual ones (docs/formats.md). Files that the scene names
    get the units and the transform that it says. `config`: the group `clean` is used.
    Raises FormatError for a file that is missing, damaged, of no known format or without a usable track.
    """
    if hasattr(paths, "columns"):
        given: dict[str, Any] = {"format": format, "frames_per_second": frames_per_second, "camera": camera}
        given |= {"metres_per_unit": metres_per_unit, "person_classes": person_classes or None}
        unused = [name for name, value in given.items() if value is not None]
        if unused:
            raise ValueError(f"read_tracks: {', '.join(unused)}: for files; a data frame has seconds and metres")
        return _from_frame(paths, config)
    if paths is None and scene is None:
        raise ValueError("read_tracks: expected paths, or a scene that names its files; found neither")
    if paths is None:
        paths = []
    elif isinstance(paths, (str, os.PathLike)):
        paths = [paths]
    elif not paths:
        raise ValueError("read_tracks: paths: expected at least one path, found 0")
    place = None if scene is None else as_scene(scene)
    tracks, report = _sila.read_files(
        [Path(path) for path in paths],
        place,
        format,
        frames_per_second,
        metres_per_unit,
        None if camera is None else Path(camera),
        [str(name) for name in person_classes],
        merged("{}", config),
    )
    return Tracks(tracks, report=json.loads(report))


def split_tracks(
    tracks: TracksLike, *, test_share: float = 0.2, seed: int = 1, by: str = "time"
) -> tuple[Tracks, Tracks]:
    """Holds back a share of the people: (to learn from, held back). Tracklets of one person stay on one side.

    by: "time" holds back a block of time and leaves out all others who were there within 5 s of a held-back person,
    as companions walk alike; "track" holds back people at random.
    Raises ValueError by time for a recording whose tracks all begin at one instant: it has no common clock.
    """
    train, test = _sila.split_tracks(list(as_tracks(tracks)), test_share, seed, by)
    return Tracks(train), Tracks(test)


def as_scene(scene: Any) -> Scene:
    """A scene, or the path of a scene file."""
    if isinstance(scene, Scene):
        return scene
    if isinstance(scene, (str, os.PathLike)):
        return Scene.load(Path(scene))
    raise TypeError(f"scene: expected a sila.Scene or the path of a scene file, found {type(scene).__name__}")


def as_tracks(tracks: TracksLike, *, config: ConfigLike = None) -> Tracks:
    """Tracks from any accepted form:

    - `Tracks`, a `Track`, or any sequence of `Track`;
    - a pandas data frame with the columns track_id, t [s], x, y [m] (and label, if there is one);
    - a dictionary from id to an array of shape (n, 3) with the columns t, x, y, or a sequence of such arrays, whose
      ids are then their numbers from 0;
    - the path of a track file, or several.

    Rows are cleaned as those of a file are; `config`: the group `clean` is used.
    """
    if isinstance(tracks, Tracks):
        return tracks
    if isinstance(tracks, Track):
        return Tracks([tracks])
    if isinstance(tracks, (str, os.PathLike)):
        return read_tracks(tracks, config=config)
    if hasattr(tracks, "columns"):
        return _from_frame(tracks, config)
    if isinstance(tracks, Mapping):
        return _from_arrays(list(tracks.items()), config)
    if isinstance(tracks, np.ndarray) and tracks.dtype != object and tracks.ndim != 3:
        raise ValueError(f"tracks: expected arrays of shape (n, 3), one a track; found one of shape {tracks.shape}")
    try:
        entries = list(tracks)
    except TypeError:
        raise TypeError(
            f"tracks: expected tracks, a data frame, a dictionary of arrays or a path; found {type(tracks).__name__}"
        ) from None
    if all(isinstance(entry, Track) for entry in entries):
        return Tracks(entries)
    if all(isinstance(entry, (str, os.PathLike)) for entry in entries):
        return read_tracks(entries, config=config)
    return _from_arrays(list(enumerate(entries)), config)


def clean(reported: Tracks, source: str, settings: str) -> Tracks:
    """Tracks as they would be if they were read from a file; rejects rows of which not one track is left."""
    ids = [track.input_id for track in reported for _ in range(len(track))]
    t = _stacked([track.times_s for track in reported], 1)
    xy = _stacked([track.positions_m for track in reported], 2)
    return clean_rows(ids, t, xy, [], source, settings)


def clean_rows(
    ids: list[str], t: NDArray[np.float64], xy: NDArray[np.float64], labels: list[str], source: str, settings: str
) -> Tracks:
    """Rows to tracks. Raises FormatError, as for a file, if there are rows and not one track is left."""
    tracks, text = _sila.clean_rows(ids, t, xy, labels, source, settings)
    report = json.loads(text)
    if ids and not tracks:
        found = ", ".join(f"{entry['rows']} rows {reason}" for reason, entry in report["dropped"].items())
        raise FormatError(source, 0, "at least one track of two samples", found)
    return Tracks(tracks, report=report)


def _from_frame(frame: Any, config: ConfigLike) -> Tracks:
    missing = [column for column in _COLUMNS if column not in frame.columns]
    if missing:
        raise ValueError(
            f"tracks: expected a data frame with the columns {', '.join(_COLUMNS)}; "
            f"{', '.join(missing)} missing in {', '.join(map(str, frame.columns))}"
        )
    labels = [] if "label" not in frame.columns else [str(label) for label in frame["label"]]
    try:
        t = np.asarray(frame["t"], dtype=np.float64)
        xy = np.column_stack([np.asarray(frame[column], dtype=np.float64) for column in ("x", "y")])
    except (TypeError, ValueError) as error:
        raise ValueError(f"tracks: expected numbers in the columns t, x, y; {error}") from None
    return _cleaned([_text(key) for key in frame["track_id"]], t, xy, labels, "data frame", config)


def _from_arrays(entries: list[tuple[Any, Any]], config: ConfigLike) -> Tracks:
    rows: list[NDArray[np.float64]] = []
    ids: list[str] = []
    for key, value in entries:
        try:
            array = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise TypeError(
                f"tracks[{key!r}]: expected numbers of shape (n, 3), found {type(value).__name__}"
            ) from None
        if array.ndim != 2 or array.shape[1] != 3:
            raise ValueError(f"tracks[{key!r}]: expected shape (n, 3) with the columns t, x, y; found {array.shape}")
        rows.append(array)
        ids += [_text(key)] * len(array)
    if not rows:
        return Tracks()
    table = np.concatenate(rows)
    return _cleaned(ids, table[:, 0], table[:, 1:], [], "arrays", config)


def _cleaned(
    ids: list[str], t: NDArray[np.float64], xy: NDArray[np.float64], labels: list[str], source: str, config: ConfigLike
) -> Tracks:
    return clean_rows(ids, t, xy, labels, source, merged("{}", config))


def _text(key: Any) -> str:
    """Ids as a CSV would have them: 17.0 of a column that once had gaps is 17."""
    return str(int(key)) if isinstance(key, (float, np.floating)) and float(key).is_integer() else str(key)


def _stacked(arrays: list[Any], dimensions: int) -> NDArray[np.float64]:
    empty = np.empty((0, 2) if dimensions == 2 else (0,))
    return np.concatenate([empty, *arrays])
