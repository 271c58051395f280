"""Pedestrians of trajdata's data sets. trajdata needs torch, so its classes are imitated here: the attributes that are used, as
in trajdata 1.4.0."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import sila
import sila.trajdata


def scene(name, agents, dt=0.5, steps=20, location="corner"):
    """Agents (name, kind, speed along x), all in view from the first to the last step."""
    return SimpleNamespace(
        name=name,
        env_name="recordings",
        location=location,
        dt=dt,
        agents=[SimpleNamespace(name=agent, type=SimpleNamespace(name=kind)) for agent, kind, _ in agents],
        length_seconds=lambda: steps * dt,
        rows=[(agent, step, speed * dt * step, 1.0) for agent, _, speed in agents for step in range(steps)],
    )


def dataset(*scenes):
    def cache(path, given):
        assert path == "cache"
        frame = pd.DataFrame(given.rows, columns=["agent_id", "scene_ts", "x", "y"])
        return SimpleNamespace(scene_data_df=frame.set_index(["agent_id", "scene_ts"]))

    return SimpleNamespace(scenes=lambda: iter(scenes), cache_class=cache, cache_path="cache")


CORNER = dataset(
    scene("morning", [("1", "PEDESTRIAN", 1.2), ("2", "VEHICLE", 9.0)]),
    scene("evening", [("1", "PEDESTRIAN", 1.5)]),
)


def test_pedestrians_of_all_scenes_are_read_with_their_times():
    tracks = sila.trajdata.read_tracks(CORNER)
    assert [track.id for track in tracks] == ["morning:1", "evening:1"]
    np.testing.assert_allclose(tracks[0].times_s, 0.5 * np.arange(20))
    np.testing.assert_allclose(tracks[1].positions_m, np.column_stack([0.75 * np.arange(20), np.ones(20)]))
    assert tracks[1].times_s[0] == 10.0 + sila.trajdata.PAUSE_S


def test_scenes_can_be_chosen():
    for scenes in (["evening"], "evening"):
        assert [track.id for track in sila.trajdata.read_tracks(CORNER, scenes=scenes)] == ["evening:1"]
    with pytest.raises(ValueError, match="expected some of morning, evening; found noon"):
        sila.trajdata.read_tracks(CORNER, scenes=["noon", "evening"])


def test_scenes_of_several_places_are_rejected():
    walker = [("1", "PEDESTRIAN", 1.2)]
    with pytest.raises(ValueError, match="one place, found recordings boston, recordings singapore"):
        sila.trajdata.read_tracks(dataset(scene("a", walker, location="boston"), scene("b", walker, location="singapore")))
    with pytest.raises(TypeError, match="expected a trajdata.UnifiedDataset, found str"):
        sila.trajdata.read_tracks("sgan_format")


def test_scenes_without_pedestrians_are_rejected():
    with pytest.raises(sila.FormatError, match="expected pedestrians"):
        sila.trajdata.read_tracks(dataset(scene("road", [("2", "VEHICLE", 9.0)])))
