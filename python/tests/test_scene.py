import copy
import pickle

import numpy as np
import pytest
import sila

OBLIQUE = {"origin": [3.0, -2.0], "axis_1": [3.0, 4.0], "axis_2": [-1.0, 0.5], "sidewalk_width_m": 2.5}


@pytest.mark.parametrize(("scaling", "unit_m"), [("metres", 1.0), ("mean_width", 2.5)])
def test_curb_coordinates_are_those_of_the_definition(scaling, unit_m):
    """q solves p = origin + unit * (q1 axis_1 + q2 axis_2): on three points and an oblique corner. In metres the axes
    have a right angle and the bisector of the curbs."""
    frame = sila.Scene(**OBLIQUE).frame(scaling=scaling)
    q = np.array([[1.0, 0.0], [0.25, -2.0], [-3.0, 0.5]])
    axes = np.array([OBLIQUE["axis_1"], OBLIQUE["axis_2"]])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    if scaling == "metres":
        between, across = (v / np.linalg.norm(v) for v in (axes[0] + axes[1], axes[1] - axes[0]))
        axes = np.stack([between - across, between + across]) / np.sqrt(2.0)
    expected = np.array(OBLIQUE["origin"]) + unit_m * q @ axes
    np.testing.assert_allclose(frame.to_world(q), expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(frame.to_curb(expected), q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(frame.velocity_to_world(q), unit_m * q @ axes, rtol=0, atol=1e-12)
    np.testing.assert_allclose(frame.velocity_to_curb(unit_m * q @ axes), q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(frame.axes, axes, rtol=0, atol=1e-15)


def test_points_of_a_wrong_shape_are_rejected_by_name():
    with pytest.raises(ValueError, match=r"points_m: expected shape \(n, 2\), found shape \(2, 3\)"):
        sila.Scene(**OBLIQUE).frame().to_curb(np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"origin: expected shape \(2,\), found shape \(3,\)"):
        sila.Scene(**{**OBLIQUE, "origin": [1.0, 2.0, 3.0]})


def test_parallel_curbs_are_rejected():
    with pytest.raises(ValueError, match="axis"):
        sila.Scene(**{**OBLIQUE, "axis_2": [-3.0, -4.0]})


def test_mirrored_axes_are_a_warning():
    mirrored = {**OBLIQUE, "axis_1": OBLIQUE["axis_2"], "axis_2": OBLIQUE["axis_1"]}
    (warning,) = sila.Scene(**mirrored).warnings
    assert warning.startswith("scene: corner '1': axis_1 and axis_2 are mirrored")
    assert sila.Scene(**OBLIQUE).warnings == sila.Scene(**mirrored, y_axis="down").warnings == []


def test_equal_objects_have_no_hashes(place, predictions):
    track = sila.Track("a", [0, 1], [[0, 0], [1, 0]])
    for value in (place.scene, place.scene.frame(), sila.Model(), track, predictions[0]):
        with pytest.raises(TypeError, match="unhashable"):
            hash(value)
        assert value.__eq__(None) is False


def test_a_scene_comes_back_from_its_file(tmp_path, place):
    place.scene.save(tmp_path / "corner.json")
    loaded = sila.Scene.load(tmp_path / "corner.json")
    assert loaded.corners == place.scene.corners
    for corner in range(len(loaded.corners)):
        np.testing.assert_allclose(
            loaded.frame(corner=corner).to_world(np.eye(2)),
            place.scene.frame(corner=corner).to_world(np.eye(2)),
            rtol=0,
            atol=1e-12,
        )


def test_the_scaling_of_a_frame_can_be_chosen():
    scene = sila.Scene(**OBLIQUE, sidewalk_width_1_m=2.0, sidewalk_width_2_m=3.0)
    assert scene.frame().unit_m.tolist() == [1.0, 1.0]
    assert scene.frame(scaling="mean_width").unit_m.tolist() == [2.5, 2.5]
    assert scene.frame().origin_m.tolist() == OBLIQUE["origin"]
    assert scene.frame() == scene.frame(scaling="metres")
    assert scene.frame(scaling="mean_width") != scene.frame()
    with pytest.raises(ValueError, match="scaling"):
        scene.frame(scaling="feet")
    with pytest.raises(ValueError, match="corner = 1, the scene has 1"):
        scene.frame(corner=1)


def test_scenes_and_frames_pickle_and_copy_bit_for_bit(place):
    for scene in (place.scene, sila.Scene(**OBLIQUE, name="bend", y_axis="down")):
        for other in (pickle.loads(pickle.dumps(scene)), copy.deepcopy(scene)):
            assert other == scene
            assert other.frame() == scene.frame()
            assert list(other.layers) == list(scene.layers)
        frame = pickle.loads(pickle.dumps(scene.frame()))
        assert frame == scene.frame()
    assert place.scene != sila.Scene(**OBLIQUE)


def test_a_scene_tells_what_it_holds(place):
    assert repr(place.scene) == f"Scene('simulated acute', {len(place.scene.corners)} corners, 0 files)"
    assert all(polygon.shape[1] == 2 for polygons in place.scene.layers.values() for polygon in polygons)
