"""The methods that an experiment file can name; any other is the path of a Python file and a class in it."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ...errors import FormatError
from ..method import Method
from .cliff import Cliff
from .knn import Knn
from .library import Accumulate, Batch, Linear, Retrain, Sila, SilaAlone, SilaWithPrior, SilaWithSimulatedPrior, Tree

METHODS: dict[str, type[Method]] = {
    "sila": Sila,
    "sila without companions": SilaAlone,
    "accumulate": Accumulate,
    "sila with prior": SilaWithPrior,
    "sila with simulated prior": SilaWithSimulatedPrior,
    "retrain": Retrain,
    "batch": Batch,
    "tree": Tree,
    "linear": Linear,
    "knn": Knn,
    "cliff": Cliff,
}


def source_of(name: str, folder: Path) -> str:
    """The Python file of a method, of which its results depend; empty for a known method."""
    return "" if name in METHODS else (folder / name.partition(":")[0]).read_text(encoding="utf-8")


def load_method(name: str, folder: Path, parameters: Mapping[str, Any] = MappingProxyType({})) -> type[Method]:
    """A known method, or the class of "file.py:Class" with the file beside the experiment's.

    Raises ImportError where the file or these parameters need what is not installed; FormatError for a file that is not there, is no
    Python or raises another error; TypeError for a class that is no complete method.
    """
    if name in METHODS:
        return METHODS[name]
    file, _, attribute = name.partition(":")
    path = folder / file
    if not path.is_file():
        raise FormatError(str(path), 0, f"a Python file with the class {attribute}", "no such file")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise FormatError(str(path), 0, "a Python file", f"a file {path.name}")
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.parent))  # for modules beside it
    try:
        with _mistakes_named(path, ModuleNotFoundError):
            spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(path.parent))
    found = getattr(module, attribute, None)
    if not (isinstance(found, type) and issubclass(found, Method)):
        raise TypeError(f"{path}: expected a class {attribute} that is a sila.experiments.Method")
    if lack := _lack_of(found):
        raise TypeError(f"{path}: expected the class {attribute} to define {lack}; it does not")
    with _mistakes_named(path, ImportError):
        found.require(parameters)
    return found


@contextmanager
def _mistakes_named(path: Path, missing: type[ImportError]) -> Iterator[None]:
    """Lets an error of the type `missing` pass if it is not about sila; any other becomes a FormatError of the file."""
    try:
        yield
    except SyntaxError as error:
        raise FormatError(error.filename or str(path), error.lineno or 0, "Python", error.msg) from None
    except Exception as error:
        if isinstance(error, missing) and (error.name or "").partition(".")[0] != "sila":
            raise
        raise FormatError(str(path), 0, "a module that can be imported", f"{type(error).__name__}: {error}") from error


def _lack_of(cls: type[Method]) -> str:
    """What a method has to define and does not; empty for a complete one."""

    def defines(name: str) -> bool:
        return getattr(cls, name) is not getattr(Method, name)

    if not defines("predict"):
        return "predict"
    if cls.elsewhere and not defines("begin_with"):
        return "begin_with, as elsewhere = True"
    if defines("partial_fit") or (cls.at_once and defines("fit")):
        return ""
    return "fit, as at_once = True" if cls.at_once else "partial_fit (fit is used with at_once = True)"
