"""Exceptions beside ValueError and TypeError."""

from __future__ import annotations

__all__ = ["FormatError", "NumericalError"]


class FormatError(ValueError):
    """A file (or a configuration) that is not what it should be."""

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
