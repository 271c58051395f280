"""Cells of tables as the readers of files take them, numbers as arguments, and the base of Tracks and Predictions."""

from __future__ import annotations

import operator
import os
import sys
import warnings
from collections.abc import Iterable, Iterator, Sequence
from numbers import Real
from pathlib import Path
from typing import Any, ClassVar, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from ._sila import class_columns

_COLUMNS = ("track_id", "t", "x", "y")

#: Ids, times [s], positions [m] of shape (n, 2), labels (none without a column of them).
Rows = tuple[list[str], NDArray[np.float64], NDArray[np.float64], list[str]]
Item = TypeVar("Item")
_Self = TypeVar("_Self", bound="Items[Any]")


class Items(Sequence[Item]):
    """A sequence of items of one type. A slice, a mask or a list of indices gives one of the same class."""

    _type: ClassVar[type]

    def __init__(self, items: Iterable[Item]) -> None:
        self._items = list(items)
        for item in self._items:
            if not isinstance(item, self._type):
                name = self._type.__name__
                raise TypeError(f"{name.lower()}s: expected sila.{name}, found {type(item).__name__}")

    def __len__(self) -> int:
        return len(self._items)

    def __iter__(self) -> Iterator[Item]:
        return iter(self._items)

    @overload
    def __getitem__(self, index: int) -> Item: ...
    @overload
    def __getitem__(self: _Self, index: slice) -> _Self: ...
    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return type(self)(self._items[index])
        if np.ndim(index) == 0:
            return self._items[index]
        chosen = np.asarray(index, dtype=None if len(index) else int)  # of an empty list it would be float
        return type(self)(self._items[i] for i in np.arange(len(self))[chosen])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Items) and self._type is other._type and self._items == other._items

    __hash__ = None  # type: ignore[assignment]


def rows_of_frame(frame: Any, track_id: Any = None, person_classes: Iterable[str] = ()) -> Rows:
    """The rows of a data frame, which without a `track_id` has a column of them."""
    if hasattr(frame, "column_names"):  # a pyarrow.Table
        frame = frame.to_pandas()
    columns = _COLUMNS if track_id is None else _COLUMNS[1:]
    missing = [column for column in columns if column not in frame.columns]
    if missing:
        raise ValueError(
            f"tracks: expected a data frame with the columns {', '.join(columns)}; "
            f"{', '.join(missing)} missing in {', '.join(map(str, frame.columns))}"
        )
    labels = labels_of_frame("tracks", frame, person_classes)
    try:
        xy = np.column_stack([floats_of(frame[column]) for column in ("x", "y")])
        t = _seconds_of(frame["t"])
    except (TypeError, ValueError) as error:
        found = str(error).partition("\n")[0].removesuffix(" You might want to try:")
        raise ValueError(f"tracks: expected numbers in the columns t, x, y, or dates in t; {found}") from None
    ids = frame["track_id"] if track_id is None else [track_id] * len(t)
    return [text_of(key) for key in ids], t, xy, labels


def _seconds_of(column: Any) -> NDArray[np.float64]:
    """Numbers, in the unit that their size tells; dates, also as ISO text, since 1970 in UTC; durations."""
    values = np.asarray(column)
    if values.dtype.kind not in "mM":
        try:
            numbers = floats_of(values)
            return numbers * _unix_unit_s(numbers)
        except (TypeError, ValueError):
            import pandas

            values = pandas.Series(column).infer_objects().to_numpy()  # durations among objects
            if values.dtype.kind != "m":
                dates = pandas.to_datetime(pandas.Series(column), utc=True, format="ISO8601")
                values = dates.to_numpy("datetime64[ns]")
    if values.dtype.kind == "m":
        return np.asarray(values / np.timedelta64(1, "s"))
    # Whole seconds apart from their fraction, so that the doubles are those of the same text in a CSV.
    whole = values.astype("datetime64[s]")
    seconds = np.asarray((whole - np.datetime64(0, "s")) / np.timedelta64(1, "s"))
    return np.asarray(seconds + (values - whole) / np.timedelta64(1, "s"))


def _unix_unit_s(numbers: NDArray[np.float64]) -> float:
    """The unit of time stamps by the first of them, as in a column `t` of a CSV file."""
    first = next(iter(numbers[np.isfinite(numbers)]), 0.0)
    return float(10.0 ** (-3 * np.searchsorted([1e11, 1e14, 1e17], first, side="right")))


def floats_of(values: Any) -> NDArray[np.float64]:
    """Numbers, NaN where they are masked or missing."""
    if isinstance(values, np.ma.MaskedArray):
        masked: Any = values.astype(np.float64)
        return np.asarray(masked.filled(np.nan))
    try:
        return np.asarray(values, dtype=np.float64)
    except TypeError:  # pandas.NA among them
        cells = np.asarray(values, dtype=object)
        numbers = [np.nan if _is_missing(cell) else cell for cell in cells.flat]
        return np.array(numbers, dtype=np.float64).reshape(cells.shape)


def whole(argument: str, value: Any, least: int, most: int = 2**31 - 1) -> int:
    try:
        number = operator.index(value)
    except TypeError:
        number = least - 1
    if isinstance(value, bool) or not least <= number <= most:
        raise ValueError(f"{argument}: expected a whole number from {least} to {most}, found {value!r}")
    return number


def number(argument: str, value: Any, expected: str = "a number") -> float:
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError(f"{argument}: expected {expected}, found {value!r}")
    return float(value)


def file_named(argument: str, value: Any) -> Path:
    if not isinstance(value, (str, os.PathLike)):
        raise TypeError(f"{argument}: expected the path of a file, found {value!r}")
    return Path(value)


def counted(number: int, noun: str) -> str:
    """A number with its noun, as in "1 track" or "2 tracks"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def text_of(key: Any) -> str:
    """As a CSV would have it: 17.0 of a column that once had gaps is 17; empty for a missing one."""
    if isinstance(key, (float, np.floating)) and float(key).is_integer():
        return str(int(key))
    text = "" if _is_missing(key) else str(key).strip()
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ValueError(f"id or class: expected valid Unicode, found {text!r}") from None
    return text


def _is_missing(cell: Any) -> bool:
    return cell is None or cell is np.ma.masked or (not isinstance(cell, str) and str(cell) in ("nan", "NaT", "<NA>"))


def names_of(person_classes: Any) -> list[str]:
    """One class, or several, as texts."""
    if not isinstance(person_classes, (int, Iterable)):
        raise TypeError(f"person_classes: expected names or numbers of classes, found {person_classes!r}")
    return [str(name) for name in ([person_classes] if isinstance(person_classes, (str, int)) else person_classes)]


def labels_of_frame(argument: str, frame: Any, person_classes: Iterable[str]) -> list[str]:
    """The classes of a data frame, whose columns must differ, as `label_for` gives them; none without a column of them."""
    columns = list(frame.columns)
    twice = next((column for column in columns if columns.count(column) > 1), None)
    if twice is not None:
        raise ValueError(f"{argument}: expected columns of different names, found {twice} twice")
    named = {str(column).lower(): column for column in reversed(columns)}
    column = next((named[name] for name in class_columns() if name in named), None)
    if column is not None:
        return [label_for(text_of(label), person_classes) for label in frame[column]]
    if person_classes:
        found = ", ".join(map(str, columns))
        raise ValueError(f"{argument}: person_classes: expected a column of classes, such as label; found {found}")
    return []


def label_for(label: str, person_classes: Iterable[str]) -> str:
    """The label as the rules for pedestrians take it; with `person_classes` by these alone."""
    if not person_classes or not label:
        return label
    return "person" if label.lower() in (name.lower() for name in person_classes) else f"not asked for: {label}"


def warn(texts: Iterable[str]) -> None:
    """Shows the texts that are not empty as one warning, where the package was called."""
    frame, level = sys._getframe(), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("sila."):
        frame, level = frame.f_back, level + 1
    if text := "; ".join(filter(None, texts)):
        warnings.warn(text, UserWarning, stacklevel=level)


def print_warning(message: Warning | str, *_: object, **__: object) -> None:
    """As `warnings.showwarning`, one line: the form in which the program prints warnings."""
    print(f"warning: {message}", file=sys.stderr)
