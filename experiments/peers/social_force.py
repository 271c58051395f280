"""Helbing and Molnár, "Social force model for pedestrian dynamics", Phys. Rev. E 51 (1995), with its parameters, a desired
velocity of the last 0.8 s, others who walk straight on, no obstacles, and the covariance of the training errors."""

from functools import partial

import numpy as np
from sila.experiments.gaussian_path import STRIDE_S, covariance_of, gaussian_forecast, moves, to_heading
from sila.experiments.method import Method, constant_velocity
from sila.experiments.neighbours import neighbours_of

RELAXATION_S, POTENTIAL, RANGE_M, STEP_S = 0.5, 2.1, 0.3, 2.0  # tau, V0 [m²/s²], sigma, Delta t
SIGHT, UNSEEN, FASTEST = np.cos(np.deg2rad(100)), 0.5, 1.3  # cos phi, c, and the largest speed relative to the desired one
length = partial(np.linalg.norm, axis=-1, keepdims=True)


class SocialForce(Method):
    at_once, social = True, True

    def fit(self, tracks):
        windows = self.windows(tracks, STRIDE_S)
        past = np.asarray(windows.past_m)
        error = np.asarray(windows.future_m) - walked(windows, neighbours_of(windows, tracks, self.config))
        self.covariance = covariance_of(np.einsum("nab,ntb->nta", to_heading(past), error)[moves(past)])

    def predict(self, windows, neighbours):
        return gaussian_forecast(np.asarray(windows.past_m), walked(windows, neighbours), self.covariance)


def walked(windows, neighbours):
    past, dt = np.asarray(windows.past_m), windows.interval_s / 2
    position, path = past[:, -1], []
    desired = velocity = (constant_velocity(past, 1, windows.interval_s)[:, 0] - position) / windows.interval_s
    for step in range(2 * windows.steps):
        others = neighbours.positions_m + step * dt * neighbours.velocities_mps
        force = repulsions(position[:, None] - others, neighbours.velocities_mps, desired).sum(1)
        velocity = velocity + dt * ((desired - velocity) / RELAXATION_S + force)
        velocity = velocity * np.minimum(1, FASTEST * length(desired) / np.maximum(length(velocity), 1e-9))
        position = position + dt * velocity
        path.append(position)
    return np.stack(path[1::2], 1)


def repulsions(apart_m, velocity_mps, desired_mps):
    """(n, k, 2) [m/s²]: -grad V0 exp(-b / sigma), b of the ellipse around the other's next step; weaker out of sight."""
    stepped = apart_m - STEP_S * velocity_mps
    a, c, step = (np.maximum(length(v), 1e-6) for v in (apart_m, stepped, STEP_S * velocity_mps))
    b = np.maximum(np.sqrt(np.maximum((a + c) ** 2 - step**2, 0)) / 2, 0.05)
    force = POTENTIAL / RANGE_M * np.exp(-b / RANGE_M) * (a + c) / (4 * b) * (apart_m / a + stepped / c)
    ahead = -(force * desired_mps[:, None]).sum(2, keepdims=True)
    unseen = ahead < SIGHT * length(force) * length(desired_mps)[:, None]
    return np.nan_to_num(np.where(unseen, UNSEEN, 1) * force)
