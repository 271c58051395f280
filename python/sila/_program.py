"""The program `sila` of the wheel, and the verbs that are Python."""

from __future__ import annotations

import os
import sys
from pathlib import Path

#: The program itself, for those who start it from Python.
PROGRAM = Path(__file__).parent / "bin" / "sila"


def main() -> None:
    """Replaces this process by the program; what is Python runs in this process."""
    if sys.argv[1:2] == ["fleet"]:
        from ._fleet_program import run

        sys.exit(run(sys.argv[2:]))
    if sys.argv[1:2] == ["experiment"]:
        from .experiments.program import run as experiment

        sys.exit(experiment(sys.argv[2:]))
    if sys.argv[1:3] == ["scene", "make"] and any(word.split("=")[0] == "--map" for word in sys.argv):
        from ._map_program import run as scene_from_map

        sys.exit(scene_from_map(sys.argv[3:]))
    os.execv(PROGRAM, ["sila", *sys.argv[1:]])
