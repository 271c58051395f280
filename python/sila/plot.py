"""Pictures on matplotlib (`pip install sila[plot]`). Every function draws into `ax` (or a new figure) and returns it.

Axes are metres in the world frame; where the scene's y axis points down, so does that of the picture. Predictions are
also drawn on the image of a camera, in its pixels.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from numbers import Real
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D

from ._ellipse import ellipse, steps_at
from ._predictions import Predictions
from ._rows import counted
from ._sila import Model, Prediction, Scene
from ._stream import Stream
from ._tracks import SceneLike, TracksLike, as_scene, as_tracks
from ._verbs import _model

__all__ = ["curb_frame", "learning_curve", "predictions", "primitive_graph", "primitives", "scene", "tracks"]

_LAYERS = {"buildings": "#c9c3b8", "sidewalks": "#e9e6df", "crosswalks": "#ffffff"}
_COLOURS = plt.get_cmap("tab20").colors  # type: ignore[attr-defined]
_MODE_COLOURS = ("#c2410c", "#1d4ed8", "#047857", "#7e22ce", "#a16207", "#0e7490")


def scene(place: SceneLike, *, ax: Axes | None = None) -> Axes:
    """Sidewalks, crosswalks and buildings of a simulated scene; scenes of files have none."""
    place, ax = as_scene(place), _world(ax)
    for name, colour in _LAYERS.items():
        polygons = place.layers.get(name, [])
        if polygons:
            ax.set_facecolor("#b8babd")
            ax.add_collection(PolyCollection(polygons, facecolor=colour, edgecolor="#8d877b", linewidth=0.6, zorder=0))
    if place.y_axis == "down" and not ax.yaxis_inverted():
        ax.invert_yaxis()
    return ax


def curb_frame(place: SceneLike, *, corner: int | None = None, reach: int = 4, ax: Axes | None = None) -> Axes:
    """The common frame of a corner: its two curbs, and lines of equal curb coordinates, one a sidewalk width."""
    place = as_scene(place)
    ax = scene(place, ax=ax)
    frame = place.frame(corner=corner, scaling="mean_width")
    steps = np.arange(-reach, reach + 1)
    for value in steps:
        style: dict[str, Any] = {"color": "#9a9a9a", "linewidth": 0.5, "zorder": 1}
        ends = np.array([[value, -reach], [value, reach]], dtype=float)
        for line in (ends, ends[:, ::-1]):
            ax.plot(*frame.to_world(line).T, **style)
    origin = (float(frame.origin_m[0]), float(frame.origin_m[1]))
    for name, tip in (("curb 1", [reach + 0.4, 0.0]), ("curb 2", [0.0, reach + 0.4])):
        end = frame.to_world([tip])[0]
        arrow = {"arrowstyle": "-|>", "color": "#b03030", "linewidth": 1.8, "shrinkA": 0, "shrinkB": 0}
        ax.annotate("", end, origin, arrowprops=arrow, zorder=4)
        text = frame.to_world([np.asarray(tip) * 1.12])[0]
        ax.annotate(name, text, color="#b03030", ha="center", va="center", zorder=4)
    ax.plot(*origin, "o", color="#b03030", markersize=4, zorder=4)
    _include(ax, frame.to_world(np.array([[-reach, -reach], [reach, -reach], [reach, reach], [-reach, reach]]) * 1.25))
    return ax


def tracks(
    given: TracksLike,
    *,
    scene: SceneLike | None = None,
    colour: str = "speed",
    longest_gap_s: float = 1.2,
    ax: Axes | None = None,
) -> Axes:
    """Tracks, coloured by `speed` [m/s] (over about 0.4 s) or by `time` since the start of each track [s]."""
    if colour not in ("speed", "time"):
        raise ValueError(f"colour: expected speed or time, found {colour}")
    ax = _place(scene, ax)
    segments, values = [], []
    for track in as_tracks(given, scene=scene):
        t, xy = track.times_s, track.positions_m
        if len(t) < 2:
            continue
        step = max(1, round(0.4 / max(float(np.median(np.diff(t))), 1e-3))) if colour == "speed" else 1
        step = min(step, len(t) - 1)
        for a in range(0, len(t) - 1, step):
            b = min(a + step, len(t) - 1)
            if np.max(np.diff(t[a : b + 1])) > longest_gap_s:
                continue
            segments.append(xy[a : b + 1])
            values.append(np.linalg.norm(xy[b] - xy[a]) / (t[b] - t[a]) if colour == "speed" else t[b] - t[0])
    lines = LineCollection(segments, array=np.asarray(values), cmap="viridis", linewidths=0.9, alpha=0.85, zorder=2)
    lines.set_clim(0.0, 2.0 if colour == "speed" else max(values, default=1.0))
    ax.add_collection(lines)
    _include(ax, np.concatenate(segments) if segments else np.zeros((0, 2)))
    label = "speed [m/s]" if colour == "speed" else "time since the start of the track [s]"
    ax.figure.colorbar(lines, ax=ax, label=label, shrink=0.8, extend="max" if colour == "speed" else "neither")
    return ax


def primitives(model: Model, *, scene: SceneLike | None = None, ax: Axes | None = None) -> Axes:
    """Motion primitives as arrows in the cells of the grid, one colour each, at the scene's primary corner."""
    model = _model("model", model)
    place = Scene.of_model(model) if scene is None else as_scene(scene)
    ax = _place(place, ax)
    frame = place.frame(scaling=model.config.get("scaling", "metres"))
    for index, primitive in enumerate(model.primitives):
        at = frame.to_world(primitive.centres)
        arrows = frame.velocity_to_world(primitive.velocities * 0.8 * model.cell_widths)
        style: dict[str, Any] = {"color": [_COLOURS[index % len(_COLOURS)]], "pivot": "mid", "width": 0.0035, "zorder": 3}
        ax.quiver(*at.T, *arrows.T, angles="xy", scale_units="xy", scale=1.0, **style)
        _include(ax, at)
    ax.set_title(f"{counted(len(model.primitives), 'primitive')} from {counted(model.tracks, 'track')}")
    return ax


def primitive_graph(
    model: Model, *, scene: SceneLike | None = None, min_count: float = 0.0, ax: Axes | None = None
) -> Axes:
    """The graph of primitives. A node is at the middle of each primitive; its size shows the count of the self
    transition. An arrow is a transition, wider for a larger count. Transitions below `min_count` are left out."""
    model = _model("model", model)
    place = Scene.of_model(model) if scene is None else as_scene(scene)
    ax = _place(place, ax)
    frame = place.frame(scaling=model.config.get("scaling", "metres"))
    middles = [frame.to_world(primitive.centres).mean(axis=0) for primitive in model.primitives]
    shown = [t for t in model.transitions if t.count >= min_count]
    most = max((t.count for t in shown), default=1.0)
    stays = np.zeros(len(middles))
    for transition in shown:
        a, b = transition.from_primitive, transition.to_primitive
        if a == b:
            stays[a] = transition.count
            continue
        share = transition.count / most
        style = {
            "arrowstyle": "-|>",
            "connectionstyle": "arc3,rad=0.15",
            "linewidth": 0.4 + 3.0 * share,
            "color": "#334155",
            "alpha": 0.35 + 0.6 * share,
            "shrinkA": 4,
            "shrinkB": 4,
        }
        ax.annotate("", middles[b], middles[a], arrowprops=style, zorder=2)
    if middles:
        points = np.array(middles)
        colours = [_COLOURS[i % len(_COLOURS)] for i in range(len(points))]
        x, y = points.T
        ax.scatter(x, y, s=25 + 175 * stays / most, c=colours, edgecolors="#1f2937", linewidths=0.6, zorder=3)
        _include(ax, points)
    ax.set_title(f"{counted(len(middles), 'primitive')}, {len(shown)} of {len(model.transitions)} transitions")
    return ax


def predictions(
    given: Prediction | Iterable[Prediction],
    *,
    tracks: TracksLike | None = None,
    scene: SceneLike | None = None,
    coverage: float | Sequence[float] = 0.9,
    at_s: float | Sequence[float] | None = None,
    image: Any = None,
    camera: str | os.PathLike[str] | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Predicted paths, one colour a mode; lighter modes are fainter. Ellipses at the seconds `at_s` after t0 (at the
    horizon if there are none) contain the share `coverage` of the outcomes of their mode; several shares give nested
    ellipses.

    With `tracks` also the observed path until t0 (black) and the true future (dotted). `image`: the path of a picture, or
    an array of shape (height, width) or (height, width, 3), on which all is drawn instead of on the scene, by `camera`,
    the path of a camera file or of a scene file with a camera (docs/formats.md). A model in pixels needs no `camera`.
    Points that the camera cannot see are left out.
    """
    shares = [coverage] if isinstance(coverage, (float, Real)) else sorted(coverage, reverse=True)
    at_s = [at_s] if isinstance(at_s, (float, Real)) else at_s
    drawn: Callable[[Any], Any] = np.asarray
    some = Predictions([given] if isinstance(given, Prediction) else given)
    if not some:
        return _place(scene, ax) if image is None else _picture(image, ax)
    scale = max(prediction.metres_per_pixel for prediction in some)
    if image is None:
        ax = _place(scene, ax)
    elif camera is not None:
        with Stream(camera=camera) as stream:
            ax, drawn = _picture(image, ax), stream.to_image
    elif scale:
        ax, drawn = _picture(image, ax), lambda points: np.asarray(points) / (scale, -scale)
    else:
        raise ValueError("image: expected camera=, the file of the camera that took it, found none")
    config = {"metres_per_pixel": scale} if scale else None  # of tracks in pixels
    by_id = {} if tracks is None else {track.id: track for track in as_tracks(tracks, scene=scene, config=config)}
    seen_modes = 0
    for prediction in some:
        for number in reversed(range(len(prediction.modes))):
            seen_modes = max(seen_modes, number + 1)
            _draw_mode(ax, prediction, number, shares, at_s, drawn)
        if prediction.tracklet in by_id:
            _draw_truth(ax, prediction, by_id[prediction.tracklet], drawn)
    ax.legend(
        handles=_legend(some, seen_modes, _coverage_text(some, shares, at_s), bool(by_id)),
        loc="best",
        fontsize="small",
        framealpha=0.9,
    )
    return ax


def learning_curve(model: Model, *, errors: Any = None, ax: Axes | None = None) -> Axes:
    """Model size after each episode over the tracks learnt. `errors`: pairs (tracks, error [m]) on a second axis, such
    as [(model.tracks, sila.evaluate(model, unseen, scene=scene).metric()), ...]."""
    model = _model("model", model)
    ax = plt.subplots(layout="constrained")[1] if ax is None else ax
    seen = np.cumsum([0, *(episode["tracks"] for episode in model.history)])
    sizes = [0, *(episode["size_after"] for episode in model.history)]
    ax.step(seen, sizes, where="post", color="#1d4ed8", label="model size")
    ax.set(
        xlabel="tracks learnt",
        ylabel="model size (primitives + transitions)",
        ylim=(0, 1.15 * max(sizes) or 1.0),
        xlim=(0, None),
    )
    handles = list(ax.lines)
    if errors is not None:
        points = np.asarray(errors, dtype=float)
        if points.ndim != 2 or points.shape[1] != 2:
            raise ValueError(f"errors: expected shape (n, 2), found {points.shape}")
        right = ax.twinx()
        handles += right.plot(*points.T, "o-", color="#c2410c", label="error on unseen tracks")
        right.set(ylabel="error [m]", ylim=(0, 1.15 * points[:, 1].max(initial=0.1)))
    ax.legend(handles=handles, loc="lower right")
    return ax


def _draw_mode(
    ax: Axes,
    prediction: Prediction,
    number: int,
    shares: Sequence[float],
    at_s: Sequence[float] | None,
    drawn: Callable[[Any], Any],
) -> None:
    mode, colour = prediction.modes[number], _MODE_COLOURS[number % len(_MODE_COLOURS)]
    strength = 0.25 + 0.75 * mode.weight / prediction.modes[0].weight
    ax.plot(*drawn(mode.path_m).T, color=colour, alpha=strength, linewidth=2.2, zorder=4)
    covariances = mode.covariances_m2
    for step in steps_at(prediction.times_s, at_s):
        ax.plot(*drawn(mode.path_m[step : step + 1]).T, ".", color=colour, alpha=strength, zorder=4)
        for share in shares:
            outline = drawn(ellipse(mode.path_m[step], covariances[step], share))
            ax.fill(*outline.T, color=colour, alpha=0.07 * strength, linewidth=0, zorder=3)
            ax.plot(*np.vstack([outline, outline[:1]]).T, color=colour, alpha=0.7 * strength, linewidth=0.9, zorder=3)
            _include(ax, outline)


def _draw_truth(ax: Axes, prediction: Prediction, track: Any, drawn: Callable[[Any], Any]) -> None:
    t, xy = track.times_s - prediction.t0_s, drawn(track.positions_m)
    before, after = t <= 1e-6, (t >= -1e-6) & (t <= prediction.times_s[-1] + 1e-6)
    ax.plot(*xy[before].T, color="black", linewidth=2.0, zorder=5)
    ax.plot(*xy[after].T, color="black", linewidth=1.6, linestyle=":", zorder=5)
    ax.plot(*xy[before][-1:].T, "o", color="black", markersize=5, zorder=5)
    _include(ax, xy[before | after])


def _coverage_text(some: Predictions, shares: Sequence[float], at_s: Sequence[float] | None) -> str:
    """Says when the ellipses are and what they are to hold: "at 2, 5 s: 50 %, 90 % coverage"."""
    times = sorted({float(p.times_s[step]) for p in some for step in steps_at(p.times_s, at_s)})
    covered = ", ".join(f"{100 * share:.4g} %" for share in sorted(shares))
    return f"at {', '.join(f'{time:.4g}' for time in times)} s: {covered} coverage"


def _legend(some: Predictions, modes: int, coverage: str, with_tracks: bool) -> list[Line2D]:
    one = some[0] if len(some) == 1 else None
    handles = []
    for number in range(modes):
        name = f"mode {number + 1}"
        if one is not None:
            mode = one.modes[number]
            name += f"{'' if mode.variant == 'expected' else f' ({mode.variant})'}: {100 * mode.weight:.0f} %"
        handles.append(Line2D([], [], color=_MODE_COLOURS[number % len(_MODE_COLOURS)], linewidth=2.2, label=name))
    handles.append(
        Line2D([], [], color="#555555", marker="o", markersize=9, fillstyle="none", linestyle="none", label=coverage)
    )
    if with_tracks:
        handles.append(
            Line2D([], [], color="black", linewidth=2.0, marker="o", markersize=5, label="observed until t0")
        )
        handles.append(Line2D([], [], color="black", linewidth=1.6, linestyle=":", label="what happened"))
    return handles


def _world(ax: Axes | None) -> Axes:
    ax = plt.subplots(figsize=(7.5, 6.5), layout="constrained")[1] if ax is None else ax
    ax.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    return ax


def _place(place: SceneLike | None, ax: Axes | None) -> Axes:
    return _world(ax) if place is None else scene(place, ax=ax)


def _picture(image: Any, ax: Axes | None) -> Axes:
    ax = plt.subplots(figsize=(7.5, 6.5), layout="constrained")[1] if ax is None else ax
    ax.imshow(plt.imread(os.fspath(image)) if isinstance(image, (str, os.PathLike)) else image, cmap="gray")
    ax.autoscale(False)
    ax.set(xlabel="u [pixels]", ylabel="v [pixels]")
    return ax


def _include(ax: Axes, points: Any, margin_m: float = 1.0) -> None:
    """Widens the view to what is drawn of people: a scene's streets would run to the horizon. An image stays whole."""
    if len(points) == 0 or ax.images:
        return
    low, high = points.min(axis=0) - margin_m, points.max(axis=0) + margin_m
    box = getattr(ax, "_sila_box", None)
    if box is not None:
        low, high = np.minimum(low, box[0]), np.maximum(high, box[1])
    ax._sila_box = (low, high)  # type: ignore[attr-defined]
    down = ax.yaxis_inverted()
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(*((high[1], low[1]) if down else (low[1], high[1])))
