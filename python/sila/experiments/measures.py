"""Measures of predicted densities, on samples: what the C++ metrics do not have. Vectorised over windows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._sila import Prediction
from .method import Array, Forecast

NOMINAL = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99)
AREAS = (0.68, 0.95)
SAMPLES = 100
MOST_MODES = 6  #: of which the least ADE is taken
ECE_BINS = 10
RESAMPLES = 500
_CHUNK = 4_000_000  # densities at once

Modes = tuple[Array, Array, Array]  # weights (n, k, t), paths (n, k, t, 2), covariances (n, k, t, 2, 2)


def modes_of(found: Forecast | Sequence[Prediction]) -> Modes:
    """The modes as arrays, padded with modes of weight 0."""
    if not isinstance(found, Forecast):
        return _padded(found)
    weights = found.weights[..., None] if found.weights.ndim == 2 else found.weights
    return np.broadcast_to(weights, found.paths_m.shape[:3]), found.paths_m, found.covariances_m2


def _padded(predictions: Sequence[Prediction]) -> Modes:
    most = max((len(p.weights) for p in predictions), default=1)
    steps = len(predictions[0].times_s) if predictions else 1
    weights, paths = np.zeros((len(predictions), most)), np.zeros((len(predictions), most, steps, 2))
    covariances = np.tile(np.eye(2), (len(predictions), most, steps, 1, 1))
    for n, prediction in enumerate(predictions):
        k = len(prediction.weights)
        weights[n, :k], paths[n, :k] = prediction.weights, prediction.paths_m[:, :steps]
        covariances[n, :k] = prediction.covariances_m2[:, :steps]
    return np.broadcast_to(weights[..., None], paths.shape[:3]), paths, covariances


def mixture_density(modes: Modes, points: Array) -> Array:
    """Density [1/m²] at points (n, s, t, 2): (n, s, t)."""
    weights, paths, covariances = modes
    a, b, c = covariances[..., 0, 0], covariances[..., 0, 1], covariances[..., 1, 1]
    determinant = np.maximum(a * c - b * b, 1e-12)
    scale = weights / (2 * np.pi * np.sqrt(determinant))
    density = np.zeros(points.shape[:3])
    for k in range(weights.shape[1]):
        d = points - paths[:, None, k]
        x, y = d[..., 0], d[..., 1]
        ak, bk, ck = (m[:, None, k] for m in (a, b, c))
        squared = (ck * x * x - 2 * bk * x * y + ak * y * y) / determinant[:, None, k]
        density += scale[:, None, k] * np.exp(-0.5 * squared)
    return density


def samples_of(modes: Modes, count: int, random: np.random.Generator, *, as_paths: bool = False) -> Array:
    """(n, count, t, 2), each step by itself; as paths: one mode and one standard deviate of a sample for all steps."""
    weights, paths, covariances = modes
    drawn = 1 if as_paths else weights.shape[2]  # steps
    edges = np.cumsum(weights / weights.sum(1, keepdims=True), 1)  # (n, k, t)
    kinds = (random.random((len(weights), count, 1, drawn)) >= edges[:, None, :-1]).sum(2)  # (n, count, t)
    factors = np.linalg.cholesky(covariances + 1e-12 * np.eye(2))
    rows, steps = np.arange(len(weights))[:, None, None], np.arange(weights.shape[2])
    normal = random.standard_normal((len(weights), count, drawn, 2))
    return np.asarray(paths[rows, kinds, steps] + np.einsum("nstab,nstb->nsta", factors[rows, kinds, steps], normal))


def measures_of(
    modes: Modes, truth_m: Array, moving: Sequence[bool], people: Sequence[str]
) -> tuple[dict[str, Array], dict[str, Any]]:
    """Per window (0 for those who stand), and for each person how many truths the regions of highest density held, by
    nominal probability and step. Densities are looked at every second step, the last included.

    energy_score_m: E|X - y| - E|X - X'| / 2, mean over the steps. area_68_m2, area_95_m2: of the regions of highest
    density of that nominal probability, mean over the steps; equal_area_*: of the one nominal probability whose regions
    hold that share of the truths, NaN where it is beyond the samples.
    """
    n, steps = len(truth_m), truth_m.shape[1]
    chosen = np.flatnonzero(np.asarray(moving, dtype=bool))
    every = np.arange(steps - 1, -1, -2)[::-1]
    energy_score, densities = np.zeros(n), [np.zeros((0, SAMPLES, len(every)))]
    confidence = np.zeros((len(chosen), len(every)))
    random, tied = np.random.default_rng(0), np.random.default_rng(1)
    for some in _chunks(len(chosen), len(every), modes[0].shape[1]):
        at = chosen[some]
        part = modes[0][at][:, :, every], modes[1][at][:, :, every], modes[2][at][:, :, every]
        truth = truth_m[at][:, every]
        first, second = samples_of(part, SAMPLES, random), samples_of(part, SAMPLES, random)
        to_truth = np.linalg.norm(first - truth[:, None], axis=-1).mean(1)
        apart = np.linalg.norm(first - second, axis=-1).mean(1)
        energy_score[at] = (to_truth - 0.5 * apart).mean(1)
        densities.append(mixture_density(part, first))
        denser = (densities[-1] > mixture_density(part, truth[:, None])).sum(1)
        # Of a density without error the rank is uniform among SAMPLES + 1, and this is uniform in [0, 1).
        confidence[some] = (denser + tied.random(denser.shape)) / (SAMPLES + 1)
    values = {"energy_score_m": energy_score}
    held = confidence <= np.array(NOMINAL)[:, None, None]  # (nominal, windows, steps)
    whose = np.asarray(people)[chosen]
    counts = {str(p): [int((whose == p).sum()), held[:, whose == p].sum(1).tolist()] for p in np.unique(whose)}
    reliability = {"nominal": list(NOMINAL), "people": counts, "steps": every.tolist()}
    return values | _areas(np.concatenate(densities), confidence, chosen, n), reliability


def _areas(density: Array, confidence: Array, chosen: NDArray[np.intp], n: int) -> dict[str, Array]:
    """Of the regions of highest density, mean over the steps. density (windows, samples, steps) is that of the samples,
    and a region holds the truth if its nominal probability is at least `confidence` (windows, steps). A region of p is
    the integral of 1 / density over the mass from 0 to p, by the midpoint rule: the sample at its edge counts half."""
    areas = {f"{name}_{100 * p:.0f}_m2": np.zeros(n) for name in ("area", "equal_area") for p in AREAS}
    if len(chosen) == 0:
        return areas
    reciprocal = np.sort(1.0 / np.maximum(density, 1e-300), axis=1)
    for p in AREAS:
        for name, level in (("area", p), ("equal_area", float(np.quantile(confidence, p)))):
            inside = np.clip(level * SAMPLES + 0.5 - np.arange(1, SAMPLES + 1), 0.0, 1.0)
            area = np.einsum("s,nst->nt", inside, reciprocal).mean(1) / SAMPLES
            areas[f"{name}_{100 * p:.0f}_m2"][chosen] = area if level < SAMPLES / (SAMPLES + 1) else np.nan
    return areas


def stepwise_measures(modes: Modes, truth_m: Array) -> dict[str, Array]:
    """What the library cannot score of mixtures whose weights change from step to step: errors of their mean path, NLL."""
    mean = np.einsum("nkt,nktc->ntc", modes[0] / modes[0].sum(1, keepdims=True), modes[1])
    error = np.linalg.norm(mean - truth_m, axis=-1)
    density = mixture_density(modes, truth_m[:, None])[:, 0]
    return {"ade_m": error.mean(1), "fde_m": error[:, -1], "nll": -np.log(np.maximum(density, 1e-300)).mean(1)}


def modes_measures(modes: Modes, stated: Sequence[Array], truth_m: Array) -> dict[str, Array]:
    """Per window. min_ade_6_m: least ADE of the six heaviest modes of different paths. ece_*: by bins of the probability
    that a path comes nearest (`stated`, for the modes of each window), the paths, the sum of these probabilities and how
    many paths came nearest.
    """
    whole = modes[0].mean(2)
    nearest = np.zeros_like(whole)
    for n, probabilities in enumerate(stated):
        nearest[n, : len(probabilities)] = probabilities
    order = np.argsort(-whole, axis=1, kind="stable")
    weights, nearest = np.take_along_axis(whole, order, 1), np.take_along_axis(nearest, order, 1)
    paths = np.take_along_axis(modes[1], order[..., None, None], 1)
    ends = paths[:, :, [paths.shape[2] // 2, -1]]
    same = (ends[:, :, None] == ends[:, None]).all((-1, -2))
    used = (weights > 0) & ~np.tril(same, -1).any(2)  # a heavier mode does not have the same path
    ade = np.where(used, np.linalg.norm(paths - truth_m[:, None], axis=-1).mean(-1), np.inf)
    values = {"min_ade_6_m": np.where(np.cumsum(used, 1) <= MOST_MODES, ade, np.inf).min(1)}
    came = np.arange(weights.shape[1]) == ade.argmin(1)[:, None]
    bins = np.minimum((ECE_BINS * nearest).astype(int), ECE_BINS - 1)
    for b in range(ECE_BINS):
        here = (bins == b) & used
        values[f"ece_modes_{b}"] = here.sum(1).astype(float)
        values[f"ece_stated_{b}"] = (nearest * here).sum(1)
        values[f"ece_nearest_{b}"] = (came & here).sum(1).astype(float)
    return values


def _chunks(windows: int, steps: int, modes: int) -> list[slice]:
    size = max(1, _CHUNK // max(1, steps * SAMPLES * min(modes, 4)))
    return [slice(first, first + size) for first in range(0, windows, size)]


class Reliability(NamedTuple):
    """One less the mean and the largest deviation of the share held from the nominal one, over nominal probabilities and
    steps; and what both would be, on average, of a density without error: the share then deviates by chance alone."""

    average: float
    least: float
    best_average: float
    best_least: float


def reliability_of(held: Array, windows: Array) -> Reliability:
    """held: counts (people, nominal, steps); windows: those of each person. Chance is that of resampling the people, as
    the windows of one person are not independent."""
    share = held.sum(0) / windows.sum()
    deviation = np.abs(share - np.array(NOMINAL)[:, None])
    best_average = best_least = np.nan
    if len(held) > 1:
        times = np.random.default_rng(0).multinomial(len(held), np.full(len(held), 1 / len(held)), RESAMPLES)
        by_chance = np.abs(np.tensordot(times, held, 1) / (times @ windows)[:, None, None] - share)
        best_average, best_least = 1 - by_chance.mean(), 1 - by_chance.max((1, 2)).mean()
    return Reliability(float(1 - deviation.mean()), float(1 - deviation.max()), float(best_average), float(best_least))


def calibration_error(sums: dict[str, float]) -> float | None:
    """Expected calibration error of the probabilities that the path of a mode comes nearest."""
    modes = sum(sums[f"ece_modes_{b}"] for b in range(ECE_BINS))
    if modes == 0:
        return None
    return sum(abs(sums[f"ece_stated_{b}"] - sums[f"ece_nearest_{b}"]) for b in range(ECE_BINS)) / modes
