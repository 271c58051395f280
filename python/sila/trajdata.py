"""Tracks of pedestrians from trajdata (Ivanovic et al., NeurIPS 2023), which reads many public data sets. It is not needed to
import this module: a caller who has a data set has trajdata, too."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from ._config import ConfigLike, merged
from ._rows import names_of
from ._tracks import Tracks, clean_rows
from .errors import FormatError

#: Between two scenes. The clock of each scene begins at 0, and no person is in two scenes.
PAUSE_S = 3600.0


def read_tracks(dataset: Any, *, scenes: Collection[str] = (), config: ConfigLike = None) -> Tracks:
    """Pedestrians of a `trajdata.UnifiedDataset`: times [s] from the start of the first scene, positions [m] in the world frame
    of its scenes. Ids have the name of the scene in front.

    `scenes`: names of scenes at one place (the default: all), which follow one another an hour apart. Rows are cleaned as those
    of files are (group `clean`). Raises FormatError if these scenes have no pedestrian, ValueError for a scene that is not there
    and for scenes of several places.
    """
    if not hasattr(dataset, "scenes"):
        raise TypeError(f"trajdata: dataset: expected a trajdata.UnifiedDataset, found {type(dataset).__name__}")
    chosen = names_of(scenes)
    ids: list[str] = []
    times: list[Any] = [np.empty(0)]
    points: list[Any] = [np.empty((0, 2))]
    names, places, start_s = [], set(), 0.0
    for scene in dataset.scenes():
        names.append(scene.name)
        if chosen and scene.name not in chosen:
            continue
        places.add(f"{scene.env_name} {scene.location}")
        walking = [agent.name for agent in scene.agents if agent.type.name == "PEDESTRIAN"]
        states = dataset.cache_class(dataset.cache_path, scene).scene_data_df
        states = states[states.index.get_level_values("agent_id").isin(walking)]
        ids += [f"{scene.name}:{agent}" for agent in states.index.get_level_values("agent_id")]
        times.append(start_s + scene.dt * states.index.get_level_values("scene_ts").to_numpy(dtype=float))
        points.append(states[["x", "y"]].to_numpy(dtype=float))
        start_s += scene.length_seconds() + PAUSE_S
    missing = sorted(set(chosen) - set(names))
    if missing:
        raise ValueError(f"trajdata: scenes: expected some of {', '.join(names)}; found {', '.join(missing)}")
    if len(places) > 1:
        raise ValueError(f"trajdata: scenes: expected scenes of one place, found {', '.join(sorted(places))}")
    if not ids:
        raise FormatError("trajdata", 0, "pedestrians in the scenes", "none")
    return clean_rows(ids, np.concatenate(times), np.concatenate(points), [], "trajdata", merged("{}", config))
