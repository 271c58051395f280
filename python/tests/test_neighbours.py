"""People present beside each other in experiments, and the methods that look at them."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy")
import sila
from sila._sila import FramedTracks
from sila.experiments.methods import load_method
from sila.experiments.neighbours import Neighbours, neighbours_of

PEERS = Path(__file__).parents[2] / "experiments/peers"


def walkers(paths):
    """Tracks of 10 s, 0.2 s apart, by the name of each person."""
    times_s = np.arange(0, 10, 0.2)
    found = [sila.Track(name, times_s, np.stack([path(t) for t in times_s])) for name, path in paths.items()]
    scene = sila.Scene(origin=(0, 0), axis_1=(1, 0), axis_2=(0, 1), sidewalk_width_m=2.5)
    return FramedTracks(found, scene, "{}")


def test_neighbours_are_those_present_at_t0_and_no_later():
    tracks = walkers({"a": lambda t: [t, 0.0], "b": lambda t: [9 - t, 1.0], "b#2": lambda t: [50.0, 50 + t]})
    windows = tracks.windows("{}", 5.0)
    found = neighbours_of(windows, tracks, "{}")
    of_a = windows.track_ids.index("a")
    t0_s = windows.t0_s[of_a]
    assert found.positions_m.shape == (len(windows), 1, 2)  # one person is there once
    assert found.positions_m[of_a, 0].tolist() in ([pytest.approx(9 - t0_s), 1.0], [50.0, pytest.approx(50 + t0_s)])
    alone = FramedTracks.joined([("first", tracks), ("second", walkers({"c": lambda t: [t, 0.5]}))])
    windows = alone.windows("{}", 5.0)
    found = neighbours_of(windows, alone, "{}")
    assert np.isnan(found.positions_m[windows.track_ids.index("second:c")]).all()  # of another recording
    assert alone.hash != alone.without_companions().hash  # which differs in the recordings alone


def test_constant_turn_rate_follows_a_circle():
    circle = walkers({"a": lambda t: [3 * np.cos(0.4 * t), 3 * np.sin(0.4 * t)]})
    windows = circle.windows("{}", 1.6)
    method = load_method("ctrv.py:Ctrv", PEERS)()
    method.fit(FramedTracks.joined([("a", circle), *((c, walkers({c: lambda t: [t, 0.0]})) for c in "bcdef")]))
    error = method.predict(windows.without_future()).paths_m[:, 0] - np.asarray(windows.future_m)
    assert np.abs(error).max() < 0.1


def test_social_force_keeps_people_apart_who_walk_towards_each_other():
    social_force = load_method("social_force.py:SocialForce", PEERS)
    assert social_force.social
    tracks = walkers({"a": lambda t: [t, 0.0], "b": lambda t: [9 - t, 0.1]})
    method = social_force()
    method.fit(tracks)
    windows = tracks.windows("{}", 5.0)
    found = neighbours_of(windows, tracks, "{}")
    y = method.predict(windows.without_future(), found).paths_m[windows.track_ids.index("a"), 0, :, 1]
    assert y.min() < -0.1  # away from b
    nan = Neighbours(np.full((len(windows), 0, 2), np.nan), np.full((len(windows), 0, 2), np.nan))
    alone = method.predict(windows.without_future(), nan).paths_m[windows.track_ids.index("a"), 0]
    assert np.abs(alone[:, 1]).max() < 1e-9
    assert alone[-1, 0] == pytest.approx(np.asarray(windows.future_m)[windows.track_ids.index("a"), -1, 0], abs=1e-6)


def test_people_of_different_recordings_are_not_drawn_together():
    from sila.experiments.sampler import together

    tracks = FramedTracks.joined([(file, walkers({"a": lambda t: [t, 0.0], "b": lambda t: [t, 1.0]})) for file in "xy"])
    assert [group.tolist() for group in together(tracks, tracks.ids, np.full(4, 30))] == [[0, 1], [2, 3]]
