"""Measures of the field's protocol, on sample paths; numpy over windows.

minADE/minFDE: the best of 20 samples. KDE-NLL: -log of a kernel density estimate at the truth, clipped at 20 as usual
(Ivanovic and Pavone, "The Trajectron", ICCV 2019). AMD, AMV: Mahalanobis distance of the truth from a mixture fitted to the
samples, and the largest eigenvalue of its mean covariance (Mohamed et al., "Social-Implicit", ECCV 2022). Col-I, Col-II:
predicted paths that come within 0.2 m of another predicted, or of another true one (Kothari et al., TrajNet++, T-ITS 2022).
"""

from __future__ import annotations

import numpy as np
from scipy.special import erf, logsumexp

from .method import Array

BEST_OF = 20
LEAST_LOG_DENSITY = -20.0
MIXTURES = 4  #: most components of the mixture of AMD
COLLISION_M = 0.2  #: two people of radius 0.1 m
PARTS = 2  #: into which a step is divided when collisions are looked for


def path_measures(mean_m: Array, samples_m: Array, truth_m: Array) -> dict[str, Array]:
    """Of each window. mean_m, truth_m (n, t, 2); samples_m (n, s, t, 2)."""
    error = np.linalg.norm(mean_m - truth_m, axis=-1)
    best = np.linalg.norm(samples_m[:, :BEST_OF] - truth_m[:, None], axis=-1)
    return {
        "ade_m": error.mean(1),
        "fde_m": error[:, -1],
        "min_ade_20_m": best.mean(2).min(1),
        "min_fde_20_m": best[:, :, -1].min(1),
        "kde_nll": -kde_log_density(samples_m, truth_m).mean(1),
    }


def kde_log_density(samples_m: Array, truth_m: Array) -> Array:
    """(n, t): Gaussian kernels with the covariance of the samples times Scott's factor, as scipy's gaussian_kde."""
    count = samples_m.shape[1]
    off = samples_m - samples_m.mean(1, keepdims=True)
    covariance = np.einsum("nsta,nstb->ntab", off, off) / (count - 1) * count ** (-1 / 3) + 1e-9 * np.eye(2)
    inverse, determinant = np.linalg.inv(covariance), np.linalg.det(covariance)
    d = samples_m - truth_m[:, None]
    x, y, (a, b, c) = d[..., 0], d[..., 1], (inverse[:, None, :, i, j] for i, j in ((0, 0), (0, 1), (1, 1)))
    squared = a * x * x + 2 * b * x * y + c * y * y
    log_density = logsumexp(-0.5 * squared, axis=1) - np.log(count) - np.log(2 * np.pi * np.sqrt(determinant))
    return np.asarray(np.maximum(log_density, LEAST_LOG_DENSITY))


def mahalanobis_measures(samples_m: Array, truth_m: Array) -> tuple[float, float]:
    """(AMD, AMV) over windows and steps. Needs scikit-learn."""
    distances, spread = [], np.zeros((2, 2))
    for samples, truth in zip(samples_m, truth_m):
        for step in range(truth.shape[0]):
            weights, means, covariances = _best_mixture(samples[:, step])
            centre = weights @ means
            off = means - centre
            spread += np.einsum("k,kab->ab", weights, covariances) + np.einsum("k,ka,kb->ab", weights, off, off)
            distances.append(mixture_distance(centre, truth[step], weights, means, covariances))
    return float(np.mean(distances)), float(np.abs(np.linalg.eigvals(spread / len(distances))).max())


def _best_mixture(points: Array) -> tuple[Array, Array, Array]:
    """More components as long as the Bayesian information criterion falls."""
    from sklearn.mixture import GaussianMixture

    best, least = None, np.inf
    for components in range(1, MIXTURES + 1):
        mixture = GaussianMixture(components, random_state=0).fit(points)
        criterion = mixture.bic(points)
        if criterion >= least:
            break
        best, least = mixture, criterion
    assert best is not None
    return best.weights_, best.means_, best.covariances_


def mixture_distance(centre: Array, point: Array, weights: Array, means: Array, covariances: Array) -> float:
    """Mahalanobis distance in a mixture: the metric is that of the components, weighed by their mass along the line."""
    line = centre - point
    top, bottom = np.zeros((2, 2)), 0.0
    for weight, mean, covariance in zip(weights, means, covariances):
        precision = np.linalg.pinv(covariance)
        along = 1 / max(float(line @ precision @ line), 1e-12)
        to_mean = mean - point
        at = along * (line @ precision @ to_mean)
        rest = to_mean @ precision @ to_mean - along * (line @ precision @ to_mean) ** 2
        limits = erf((1 - at) / np.sqrt(2 * along)) + erf(at / np.sqrt(2 * along))
        mass = weight * np.sqrt(np.pi * along / 2) * np.exp(-rest / 2) * limits
        top += precision * mass
        bottom += mass
    return float(np.sqrt(line @ (top / bottom) @ line)) if bottom > 0 else 0.0


def collides(paths_m: Array, others_m: Array) -> Array:
    """(n,): whether the path of a person comes near another person's at the same time. Both (n, t, 2) of the same people;
    steps are divided into parts."""
    apart = others_m[None] - paths_m[:, None]  # (n, n, t, 2)
    share = np.arange(PARTS)[:, None, None] / PARTS
    between = apart[:, :, None, :-1] * (1 - share) + apart[:, :, None, 1:] * share
    nearest = np.minimum(np.linalg.norm(between, axis=-1).min((2, 3)), np.linalg.norm(apart[:, :, -1], axis=-1))
    np.fill_diagonal(nearest, np.inf)
    return np.asarray((nearest <= COLLISION_M).any(1))
