"""The other people who are present at t0 of a window, for methods with interactions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._config import merged
from .._sila import FramedTracks, WindowSet, person_of
from .method import CONSTANT_VELOCITY_S, Array, Method

RECENT_S = 0.5  #: a person whose last position is older is not present; interruptions of the tracker are shorter


@dataclass(frozen=True)
class Neighbours:
    """At t0 of n windows, at most k others each; missing ones are NaN."""

    positions_m: Array  #: (n, k, 2)
    velocities_mps: Array  #: (n, k, 2), means over the last 0.8 s


def neighbours_of(windows: WindowSet, tracks: FramedTracks, config: str) -> Neighbours:
    """Those of `tracks`, which include the windows' own, who have been there for 0.8 s at t0 of each window, in the same
    recording, apart from its own person. Nothing after t0 is used."""
    short = {"predict": dict.fromkeys(("horizon_s", "mode_horizon_s"), windows.interval_s)}
    short["predict"]["observe_s"] = CONSTANT_VELOCITY_S + windows.interval_s
    seen = tracks.windows(merged(config, short), windows.interval_s)
    order = np.argsort(seen.t0_s, kind="stable")
    times, past = np.asarray(seen.t0_s)[order], np.asarray(seen.past_m)[order]
    velocity = (past[:, -1] - past[:, 0]) / ((past.shape[1] - 1) * windows.interval_s)
    numbers = {name: i for i, name in enumerate(dict.fromkeys(map(person_of, tracks.ids)))}
    person = np.array([numbers[person_of(track)] for track in seen.track_ids], dtype=int)[order]
    recordings = dict(zip(tracks.ids, tracks.recordings))
    recording = np.array([recordings[track] for track in seen.track_ids], dtype=int)[order]
    found = []
    for track, t0_s in zip(windows.track_ids, windows.t0_s):
        first, end = np.searchsorted(times, [t0_s - RECENT_S, t0_s + 1e-6])
        here = first + np.flatnonzero(recording[first:end] == recordings[track])[::-1]  # the latest first
        present, latest = np.unique(person[here], return_index=True)
        at = here[latest[present != numbers[person_of(track)]]]
        found.append((past[at, -1] + (t0_s - times[at])[:, None] * velocity[at], velocity[at]))
    most = max((len(positions) for positions, _ in found), default=0)
    padded = np.full((2, len(found), most, 2), np.nan)
    for i, (positions, velocities) in enumerate(found):
        padded[0, i, : len(positions)], padded[1, i, : len(positions)] = positions, velocities
    return Neighbours(*padded)


def inputs_of(method: Method, windows: WindowSet, tracks: FramedTracks) -> tuple[Any, ...]:
    """What `predict` of a method gets: windows without their futures, and of `tracks` the neighbours if it asks for them."""
    blind = windows.without_future()
    return (blind, neighbours_of(windows, tracks, method.config)) if method.social else (blind,)
