"""Progress in a terminal or a notebook, if tqdm is installed."""

from __future__ import annotations

import sys
import warnings
from typing import Any


class _Silent:
    def update(self, n: int = 1) -> None: ...
    def set_postfix_str(self, text: str) -> None: ...
    def __enter__(self) -> _Silent:  # noqa: PYI034
        return self

    def __exit__(self, *_: object) -> None: ...


def bar(progress: bool | None, total: int, text: str, unit: str) -> Any:
    """`progress`: True shows it, False does not, None shows it in a terminal or a notebook."""
    if progress is None:
        progress = sys.stderr.isatty() or "ipykernel" in sys.modules
    if not progress:
        return _Silent()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of notebooks without ipywidgets, where it writes text instead
            from tqdm.auto import tqdm
    except ImportError:
        return _Silent()
    return tqdm(total=total, desc=text, unit=unit)
