"""Configurations as nested dictionaries. Names, defaults, units and ranges are those of the C++ `fields()`."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Union

from . import _sila
from .errors import FormatError, UsageError

#: A nested (or dotted) dictionary of fields, or the path of a JSON file with one. The key "profile" ("default",
#: "paper" or "paper-literal") gives the values to begin with.
ConfigLike = Union[Mapping[str, Any], str, "os.PathLike[str]", None]


@dataclass(frozen=True)
class Field:
    """One field of the configuration."""

    path: str
    default: str
    unit: str
    range: str
    meaning: str


def fields() -> list[Field]:
    """Every configuration field, in the order of `sila config`."""
    return [Field(*row) for row in _sila.config_fields()]


def config(changes: ConfigLike = None) -> dict[str, Any]:
    """The default configuration as a nested dictionary, with `changes`; checked.

    Raises FormatError for an unknown field (naming the nearest known one), a wrong type or a value out of range.
    """
    result: dict[str, Any] = json.loads(merged("{}", changes))
    return result


def assignments(file: str | os.PathLike[str] | None, assigned: Iterable[str]) -> dict[str, Any]:
    """The changes of a configuration file, then those of texts PATH=VALUE; the file is checked by itself."""
    changes: dict[str, Any] = {}
    if file is not None:
        changes = json.loads(_sila.config_from_file(os.fspath(file)))
        config(file)
    for assignment in assigned:
        name, equals, value = assignment.partition("=")
        if not equals:
            raise UsageError(f"--set: expected PATH=VALUE, found {assignment}")
        # A dotted key replaces the same one of the file and is applied after a group of the file, as keys are sorted.
        try:
            changes[name] = json.loads(value)
        except json.JSONDecodeError:
            changes[name] = value
    try:
        config(changes)
    except FormatError as error:  # of the assignments, for the file was checked
        raise UsageError(f"--set: {error}") from None
    return changes


def merged(base: str, changes: ConfigLike) -> str:
    """JSON of the whole configuration: the defaults, changed by `base`, then by `changes`. Raises as `config`."""
    source = "config"
    if changes is None:
        text = "{}"
    elif isinstance(changes, Mapping):
        text = json.dumps(_plain(changes), allow_nan=False, default=_no_value)
    elif isinstance(changes, (str, os.PathLike)):
        source = os.fspath(changes)
        text = _sila.config_from_file(source)
    else:
        raise TypeError(f"config: expected a dictionary or the path of a JSON file, found {type(changes).__name__}")
    return _sila.merged_config(base, text, source)


def _no_value(value: Any) -> Any:
    raise TypeError(f"config: expected numbers, texts, lists and dictionaries, found {value!r}")


def _plain(value: Any) -> Any:
    """NumPy scalars as numbers, infinities as their text in JSON."""
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if hasattr(value, "item") and getattr(value, "ndim", None) == 0:
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
    return value
