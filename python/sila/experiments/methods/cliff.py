"""CLiFF-LHMP: paths drawn from a map of dynamics, a mixture over direction and speed in each cell.

Source: Zhu et al., "CLiFF-LHMP: Using Spatial Dynamics Patterns for Long-Term Human Motion Prediction", IROS 2023; the
map: Kucner et al., "Enabling Flow Awareness for Mobile Robots in Partially Observable Environments", RA-L 2017.
Differs: where no cell is near the velocity is kept, instead of the prediction ending; the cell with most samples stands
for that with the highest motion ratio; standing people are not in the map; mean shift of fixed widths; beta 10 and
sigma 0.4 s, which served best on vru, students03 and zara01 (published: 1 and 1.5 s, for steps of 0.4 to 1 s).
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from ..._sila import CurbFrame, FramedTracks, WindowSet
from ..method import Array, Forecast, Method, constant_fallback, kernel_forecast

SHIFT_SCALE = np.array([0.5, 0.3])  # rad, m/s: widths of the mean shift
STARTS, SHIFT_SAMPLES, ROUNDS = 40, 400, 30
LEAST_VARIANCE = np.diag([0.01, 0.0025])  # the noise of the samples; a narrower Gaussian would be an accident
LEAST_WEIGHT = 0.02
WRAPS = 2 * np.pi * np.array([-1, 0, 1])

Mixture = tuple[Array, Array, Array]  # weights (k,), means (k, 2), covariances (k, 2, 2) of (direction, speed)


def wrapped(angle: Array) -> Array:
    return (angle + np.pi) % (2 * np.pi) - np.pi


def difference(a: Array, b: Array) -> Array:
    return np.stack([wrapped(a[..., 0] - b[..., 0]), a[..., 1] - b[..., 1]], -1)


def mean_shift(samples: Array) -> Array:
    """The modes of the density of the samples."""
    few = samples[:: -(-len(samples) // SHIFT_SAMPLES)]
    places = samples[:: -(-len(samples) // STARTS)].copy()
    for _ in range(ROUNDS):
        off = difference(few[None], places[:, None])
        weight = np.exp(-0.5 * ((off / SHIFT_SCALE) ** 2).sum(-1, keepdims=True))
        shift = (weight * off).sum(1) / np.maximum(weight.sum(1), 1e-300)
        places = np.stack([wrapped(places[:, 0] + shift[:, 0]), places[:, 1] + shift[:, 1]], -1)
        if ((shift / SHIFT_SCALE) ** 2).sum(-1).max() < 1e-6:
            break
    modes = places[:1]
    for place in places[1:]:
        if (((difference(modes, place) / SHIFT_SCALE) ** 2).sum(-1) >= 1).all():
            modes = np.vstack([modes, place])
    return modes


def fit_mixture(samples: Array) -> Mixture:
    """A semi-wrapped Gaussian mixture: mean shift finds the modes, expectation maximisation their shapes."""
    means = mean_shift(samples)
    weights = np.full(len(means), 1 / len(means))
    covariances = np.repeat(np.diag(SHIFT_SCALE**2)[None], len(means), 0)
    unwrapped = samples[None] + np.stack([WRAPS, np.zeros(3)], -1)[:, None]  # (3, n, 2)
    for _ in range(ROUNDS):
        off = unwrapped[None] - means[:, None, None]  # (k, 3, n, 2)
        squared = np.einsum("kwna,kab,kwnb->kwn", off, np.linalg.inv(covariances), off)
        norm = weights / (2 * np.pi * np.sqrt(np.linalg.det(covariances)))
        density = norm[:, None, None] * np.exp(-0.5 * squared)
        total = density.sum((0, 1))
        share = np.where(total < 1e-300, 0, density / np.maximum(total, 1e-300))  # an outlier shapes nothing
        mass = share.sum((1, 2))
        kept = mass >= LEAST_WEIGHT * max(mass.sum(), 1e-300)
        if len(mass) == 1:
            kept[:] = True
        if not kept.any():
            break
        first = np.einsum("kwn,kwna->ka", share, off) / np.maximum(mass, 1e-300)[:, None]
        second = np.einsum("kwn,kwna,kwnb->kab", share, off, off) / np.maximum(mass, 1e-300)[:, None, None]
        covariances = (second - np.einsum("ka,kb->kab", first, first) + LEAST_VARIANCE)[kept]
        means = (means + first)[kept]
        means[:, 0], weights = wrapped(means[:, 0]), mass[kept] / max(mass.sum(), 1e-300)
    return weights / weights.sum(), means, covariances


class Cliff(Method):
    """Other sites are laid over the first one by their curb frames."""

    parameters: ClassVar[dict[str, Any]] = {
        "cell_m": 1.0,
        "radius_m": 1.0,  # of the cells whose centre is so near the one with most samples answers (r_s)
        "beta": 10.0,  # trust in the person's own velocity against that of the map
        "step_s": 0.4,  # between two draws from the map (Delta t)
        "velocity_sigma_s": 0.4,  # kernel that weighs the observed velocities, the latest most (sigma)
        "least_speed_mps": 0.1,  # slower samples have no direction and are left out of the map
        "rollouts": 20,
    }
    frame: CurbFrame | None = None

    def __init__(self, config: str = "{}", **parameters: Any) -> None:
        super().__init__(config, **parameters)
        self.samples: dict[tuple[int, int], list[Array]] = {}
        self.mixtures: dict[tuple[int, int], Mixture] = {}  # of the cells whose samples have not changed since

    @property
    def size(self) -> int:
        """Gaussians of the cells that are fitted: all of them after a prediction."""
        return sum(len(weights) for weights, _, _ in self.mixtures.values())

    def partial_fit(self, tracks: FramedTracks) -> None:
        self.frame = self.frame or tracks.frame(0)
        position, velocity = tracks.samples(self.config, self.frame)
        speed = np.linalg.norm(velocity, axis=1)
        cells = np.floor(position / self.cell_m).astype(int)
        polar = np.stack([np.arctan2(velocity[:, 1], velocity[:, 0]), speed], -1)
        moving = speed >= self.least_speed_mps
        for cell, sample in zip(map(tuple, cells[moving].tolist()), polar[moving]):
            self.samples.setdefault(cell, []).append(sample)
            self.mixtures.pop(cell, None)

    def predict(self, windows: WindowSet) -> Forecast:
        if self.frame is None or not self.samples:
            return constant_fallback(windows)
        random = np.random.default_rng(self.seed)
        position, velocity, _ = windows.laid_over(self.frame)
        past_s = windows.interval_s * np.arange(velocity.shape[1])[::-1]
        weight = np.exp(-0.5 * (past_s / self.velocity_sigma_s) ** 2)
        own = np.einsum("t,ntc->nc", weight / weight.sum(), velocity)
        polar = np.stack([np.arctan2(own[:, 1], own[:, 0]), np.linalg.norm(own, axis=1)], -1)
        polar, place = (np.repeat(a, self.rollouts, 0) for a in (polar, position[:, -1]))
        held, path = max(1, round(self.step_s / windows.interval_s)), []
        for step in range(windows.steps):
            if step % held == 0:
                off = self._drawn(place, random, polar)
                polar = polar + off * np.exp(-self.beta * off**2)
            direction = np.stack([np.cos(polar[:, 0]), np.sin(polar[:, 0])], -1)
            place = place + windows.interval_s * polar[:, 1:] * direction
            path.append(place)
        paths = np.stack(path, 1).reshape(len(position), self.rollouts, windows.steps, 2)
        laid = windows.laid_back(paths, self.frame)
        return kernel_forecast(np.ones(paths.shape[:2]), laid, windows.interval_s)

    def _fitted(self) -> dict[tuple[int, int], Mixture]:
        for cell, samples in self.samples.items():
            if cell not in self.mixtures:
                self.mixtures[cell] = fit_mixture(np.array(samples))
        return self.mixtures

    def _drawn(self, place: Array, random: np.random.Generator, polar: Array) -> Array:
        """Of each person a velocity drawn from the map, less the person's own; 0 where no cell is near."""
        mixtures = list(self._fitted().items())
        corner = np.min([cell for cell, _ in mixtures], 0)
        table = np.full(np.max([cell for cell, _ in mixtures], 0) - corner + 1, -1)
        for index, (cell, _) in enumerate(mixtures):
            table[tuple(cell - corner)] = index
        counts = np.array([len(self.samples[cell]) for cell, _ in mixtures] + [-1])  # the last: no cell
        reach = np.arange(-int(np.ceil(self.radius_m / self.cell_m)), int(np.ceil(self.radius_m / self.cell_m)) + 1)
        near = np.floor(place / self.cell_m).astype(int)[:, None] + np.stack(np.meshgrid(reach, reach), -1).reshape(
            -1, 2
        )
        far = np.linalg.norm((near + 0.5) * self.cell_m - place[:, None], axis=-1) > self.radius_m
        inside = ((near >= corner) & (near < corner + table.shape)).all(-1) & ~far
        at = np.where(inside[..., None], near - corner, 0)
        found = np.where(inside, table[at[..., 0], at[..., 1]], -1)
        chosen = np.take_along_axis(found, counts[found].argmax(1)[:, None], 1)[:, 0]
        off = np.zeros_like(place)
        for index in np.unique(chosen[chosen >= 0]):
            weights, means, covariances = mixtures[index][1]
            people = np.flatnonzero(chosen == index)
            kinds = random.choice(len(weights), len(people), p=weights)
            factors = np.linalg.cholesky(covariances)[kinds]
            drawn = means[kinds] + np.einsum("nab,nb->na", factors, random.normal(size=(len(people), 2)))
            drawn[:, 1] = np.maximum(0, drawn[:, 1])
            off[people] = difference(drawn, polar[people])
        return off
