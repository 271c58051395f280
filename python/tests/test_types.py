"""The stubs say what the module does, and a user's program type-checks against the package."""

import ast
import subprocess
import sys
from pathlib import Path

import sila

USER = """
import numpy as np
import sila

scene = sila.Scene(origin=[0.0, 0.0], axis_1=[1.0, 0.0], axis_2=[0.0, 1.0], sidewalk_width_m=2.0)
tracks = sila.read_tracks("tracks.csv", scene=scene)
model = sila.learn(tracks, scene=scene, batch=20, config={"predict": {"horizon_s": 3.0}})
model.save("corner.sila")
size: int = model.size
for prediction in sila.predict(model, {"a": np.zeros((3, 3))}, scene="corner.json"):
    weight: float = prediction.modes[0].weight
    first = prediction.paths_m[0]
error: float = sila.evaluate(model, tracks, scene=scene).metric()
predictor = sila.Predictor(scene, predict__horizon_s=3.0).partial_fit(tracks)
"""
WRONG = """
import sila

sila.learn("tracks.csv", "corner.json")
sila.Model().size = 3
sila.simulate(tracks=3).tracks.positions_m
"""


def mypy(folder, *arguments):
    command = [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def mypy_of(folder, program):
    (folder / "user.py").write_text(program)
    return mypy(folder, "--cache-dir", str(folder), "user.py")


def names_in(body):
    """Names that a stub defines, those of classes with the names of their members."""
    found = {}
    for node in body:
        if isinstance(node, ast.ClassDef):
            found[node.name] = set(names_in(node.body))
        elif isinstance(node, ast.FunctionDef):
            found[node.name] = set()
        elif isinstance(node, ast.AnnAssign):
            found[node.target.id] = set()
    return found


def test_the_stub_has_every_name_of_the_module_and_no_other():
    stub = names_in(ast.parse((Path(sila.__file__).parent / "_sila.pyi").read_text()).body)
    module = {name for name in vars(sila._sila) if not name.startswith("_")}
    assert set(stub) == module
    # nanobind adds these to every class, an __init__ that rejects included.
    inherited = {"__doc__", "__module__", "__new__", "__hash__", "__dict__", "__weakref__", "__init__"}
    for name in module:
        if isinstance(getattr(sila._sila, name), type):
            assert set(vars(getattr(sila._sila, name))) - inherited == stub[name] - inherited, name


def test_the_package_and_its_stub_type_check(tmp_path):
    run = mypy(tmp_path, "--allow-any-generics", "-p", "sila")
    assert run.returncode == 0, run.stdout


def test_a_users_program_type_checks(tmp_path):
    run = mypy_of(tmp_path, USER)
    assert run.returncode == 0, run.stdout


def test_a_wrong_program_does_not(tmp_path):
    lines = mypy_of(tmp_path, WRONG).stdout
    for line in (4, 5, 6):
        assert f"user.py:{line}: error" in lines
