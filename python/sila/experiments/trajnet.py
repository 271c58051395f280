"""TrajNet++'s format: JSON lines of scenes, true tracks and predictions, for its own tool (trajnetplusplustools)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .method import Array
from .sampler import DRAWN, SEEN, STEP_S

Window = tuple[str, int, Array, Array]  #: track, frame of t0, (8, 2) seen, (12, 2) true


def write_trajnet(folder: Path, name: str, windows: Sequence[Window], paths_m: Array) -> tuple[Path, Path]:
    """`truth/NAME.ndjson` with scenes and true tracks, `predicted/NAME.ndjson` with scenes and predictions.

    paths_m (n, k, 12, 2), of each window k predictions, the first the one that is scored alone. A frame is a step of
    0.4 s; each window is a scene whose primary pedestrian is its track.
    """
    numbers = {track: i for i, track in enumerate(dict.fromkeys(track for track, *_ in windows))}
    scenes, truth, predicted = [], {}, []
    for i, ((track, t0, seen, true), paths) in enumerate(zip(windows, paths_m)):
        person = numbers[track]
        frames = range(t0 - SEEN + 1, t0 + DRAWN + 1)
        scene = {"id": i, "p": person, "s": frames[0], "e": frames[-1], "fps": 1 / STEP_S, "tag": [0, []]}
        scenes.append(json.dumps({"scene": scene}))
        for frame, point in zip(frames, np.concatenate([seen, true])):
            truth[frame, person] = _track(frame, person, point)
        for k, path in enumerate(paths):
            for frame, point in zip(frames[SEEN:], path):
                predicted.append(_track(frame, person, point, f', "prediction_number": {k}, "scene_id": {i}'))
    written = []
    for kind, rows in (("truth", [truth[key] for key in sorted(truth)]), ("predicted", predicted)):
        (folder / kind).mkdir(parents=True, exist_ok=True)
        written.append(folder / kind / f"{name}.ndjson")
        written[-1].write_text("".join(row + "\n" for row in [*scenes, *rows]), encoding="utf-8")
    return written[0], written[1]


def _track(frame: int, person: int, point: Array, more: str = "") -> str:
    return f'{{"track": {{"f": {frame}, "p": {person}, "x": {point[0]:.4f}, "y": {point[1]:.4f}{more}}}}}'
