"""The `sila` program that the wheel brings."""

from __future__ import annotations

import os
import sys
from pathlib import Path

#: The program itself, for those who start it from Python.
PROGRAM = Path(__file__).parent / "bin" / "sila"


def main() -> None:
    """Puts the program in the place of this process."""
    os.execv(PROGRAM, ["sila", *sys.argv[1:]])
