"""Cells of tables as the readers of files take them."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

_COLUMNS = ("track_id", "t", "x", "y")

#: Ids, times [s], positions [m] of shape (n, 2), labels (none without a column of them).
Rows = tuple[list[str], NDArray[np.float64], NDArray[np.float64], list[str]]


def rows_of_frame(frame: Any) -> Rows:
    missing = [column for column in _COLUMNS if column not in frame.columns]
    if missing:
        raise ValueError(
            f"tracks: expected a data frame with the columns {', '.join(_COLUMNS)}; "
            f"{', '.join(missing)} missing in {', '.join(map(str, frame.columns))}"
        )
    labels = [] if "label" not in frame.columns else [text_of(label).strip() for label in frame["label"]]
    try:
        xy = np.column_stack([np.asarray(frame[column], dtype=np.float64) for column in ("x", "y")])
        t = _seconds_of(frame["t"])
    except (TypeError, ValueError) as error:
        raise ValueError(f"tracks: expected numbers in the columns t, x, y, or dates in t; {error}") from None
    return [text_of(key) for key in frame["track_id"]], t, xy, labels


def _seconds_of(column: Any) -> NDArray[np.float64]:
    """Numbers as they are; dates, also as ISO text, since 1970 in UTC; durations."""
    values = np.asarray(column)
    if values.dtype.kind not in "mM":
        try:
            return np.asarray(values, dtype=np.float64)
        except (TypeError, ValueError):
            import pandas

            values = pandas.to_datetime(pandas.Series(column), utc=True, format="ISO8601").to_numpy("datetime64[ns]")
    if values.dtype.kind == "m":
        return np.asarray(values / np.timedelta64(1, "s"))
    # Whole seconds apart from their fraction, so that the doubles are those of the same text in a CSV.
    whole = values.astype("datetime64[s]")
    seconds = np.asarray((whole - np.datetime64(0, "s")) / np.timedelta64(1, "s"))
    return np.asarray(seconds + (values - whole) / np.timedelta64(1, "s"))


def counted(number: int, noun: str) -> str:
    """A number with its noun, as in "1 track" or "2 tracks"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def text_of(key: Any) -> str:
    """As a CSV would have it: 17.0 of a column that once had gaps is 17; empty for a missing one."""
    if isinstance(key, (float, np.floating)) and float(key).is_integer():
        return str(int(key))
    missing = key is None or (not isinstance(key, str) and str(key) in ("nan", "NaT", "<NA>"))
    return "" if missing or not str(key).strip() else str(key)


def names_of(person_classes: Any) -> list[str]:
    """One class, or several, as texts."""
    return [str(name) for name in ([person_classes] if isinstance(person_classes, (str, int)) else person_classes)]


def warn(report: Mapping[str, Any]) -> None:
    """Shows the warnings of a report where the package was called."""
    frame, level = sys._getframe(), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("sila."):
        frame, level = frame.f_back, level + 1
    if report["warnings"]:
        warnings.warn("; ".join(report["warnings"]), UserWarning, stacklevel=level)
