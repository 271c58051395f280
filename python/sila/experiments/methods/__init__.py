"""The methods that an experiment file can name; any other is the path of a Python file and a class in it."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from ..method import Method
from .cliff import Cliff
from .knn import Knn
from .library import Accumulate, Batch, Linear, Retrain, Sila, SilaWithPrior, Tree

METHODS: dict[str, type[Method]] = {
    "sila": Sila,
    "accumulate": Accumulate,
    "sila with prior": SilaWithPrior,
    "retrain": Retrain,
    "batch": Batch,
    "tree": Tree,
    "linear": Linear,
    "knn": Knn,
    "cliff": Cliff,
}


def load_method(name: str, folder: Path) -> type[Method]:
    """A known method, or the class of "file.py:Class" with the file beside the experiment's.

    Raises ImportError where the file needs what is not installed.
    """
    if name in METHODS:
        return METHODS[name]
    file, _, attribute = name.partition(":")
    path = folder / file
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path}: cannot be imported")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found = getattr(module, attribute, None)
    if not (isinstance(found, type) and issubclass(found, Method)):
        raise TypeError(f"{path}: expected a class {attribute} that is a sila.experiments.Method")
    return found
