"""Exceptions other than ValueError and TypeError."""

from __future__ import annotations

import sys

__all__ = ["FormatError", "NumericalError"]


class FormatError(ValueError):
    """A file or a configuration that cannot be used. `line` counts from 1; 0: the whole file."""

    def __init__(self, path: str, line: int, expected: str, found: str) -> None:
        super().__init__(path, line, expected, found)
        self.path = path
        #: 1-based; 0 means the whole file.
        self.line = line
        self.expected = expected
        self.found = found

    def __str__(self) -> str:
        place = f"{self.path}:{self.line}" if self.line else self.path
        return f"{place}: expected {self.expected}, found {self.found}"


class NumericalError(ArithmeticError):
    """A computation that failed after every documented remedy."""


class UsageError(ValueError):
    """A wrong command line, whatever the files contain: exit code 2."""


def failed(error: BaseException, interrupted: str) -> int:
    """Says on stderr why a verb of the program ends, `interrupted` what an interrupt leaves; the exit code: 1 for bad
    input, 2 for a wrong command line or a missing extra, 130 for an interrupt."""
    if isinstance(error, KeyboardInterrupt):
        print(f"sila: interrupted; {interrupted}", file=sys.stderr)
        return 130
    print(f"sila: {error}", file=sys.stderr)
    return 2 if isinstance(error, (UsageError, ImportError)) else 1
