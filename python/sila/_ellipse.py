"""Ellipses of covariances."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray


def ellipse(mean: Any, covariance: Any, coverage: float, points: int = 48) -> NDArray[np.float64]:
    """The ellipse round `mean` (2,) that holds the share `coverage` of a normal distribution with `covariance` (2, 2).

    Returns (points, 2). In two dimensions the squared radius in standard deviations is -2 log(1 - coverage).
    """
    if not isinstance(coverage, Real) or not 0.0 < coverage < 1.0:
        raise ValueError(f"coverage: expected a number between 0 and 1, found {coverage!r}")
    variances, directions = np.linalg.eigh(np.asarray(covariance, dtype=float))
    angle = np.linspace(0.0, 2.0 * math.pi, points, endpoint=False)
    circle = np.column_stack([np.cos(angle), np.sin(angle)]) * math.sqrt(-2.0 * math.log1p(-coverage))
    result: NDArray[np.float64] = (
        np.asarray(mean, dtype=float) + (circle * np.sqrt(np.maximum(variances, 0.0))) @ directions.T
    )
    return result


def steps_at(times_s: Any, at_s: Sequence[float] | None) -> list[int]:
    """Indices of the times nearest to those wanted, as far as the horizon reaches; None wants the last one."""
    times = np.asarray(times_s)
    if at_s is None:
        return [len(times) - 1]
    return sorted({int(np.argmin(np.abs(times - second))) for second in at_s if 0.0 < second <= times[-1] + 1e-9})
