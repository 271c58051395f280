"""Constant turn rate and velocity (e.g. Schubert, Richter and Wanielik 2008, "Comparison and evaluation of advanced motion
models for vehicle tracking"), with the covariance of its errors on the training windows. The turn rate is that between
the means of the velocity over the last 0.8 s and the 0.8 s before, or over the two halves of a shorter past."""

import numpy as np
from sila.experiments.gaussian_path import GaussianPath, to_heading
from sila.experiments.method import CONSTANT_VELOCITY_S, constant_velocity

LEAST_SPEED_MPS = 0.3  # slower people are predicted straight on: their heading is noise


class Ctrv(GaussianPath):
    def learn(self, past_m, deviation_m, person):
        steps = deviation_m.shape[1]

        def deviation_of(past):
            error = turned(past, steps, self.interval_s) - constant_velocity(past, steps, self.interval_s)
            return np.einsum("nab,ntb->nta", to_heading(past), error)

        return deviation_of, deviation_of(past_m)


def turned(past_m, steps, interval_s):
    """(n, steps, 2): arcs of the circles that the last positions are on."""
    back = max(1, min(round(CONSTANT_VELOCITY_S / interval_s), (past_m.shape[1] - 1) // 2))
    over_s = back * interval_s
    late = past_m[:, -1] - past_m[:, -1 - back]
    early = past_m[:, -1 - back] - past_m[:, max(0, past_m.shape[1] - 1 - 2 * back)]
    speed = np.linalg.norm(late, axis=1) / over_s
    cross = early[:, 0] * late[:, 1] - early[:, 1] * late[:, 0]
    rate = np.arctan2(cross, (early * late).sum(1)) / over_s
    slow = np.minimum(speed, np.linalg.norm(early, axis=1) / over_s) < LEAST_SPEED_MPS
    rate = np.where(slow, 0.0, rate)[:, None]
    ahead_s = interval_s * np.arange(1, steps + 1)
    heading = np.arctan2(late[:, 1], late[:, 0])[:, None] + rate * (over_s + ahead_s) / 2  # of the chord of each arc
    length = speed[:, None] * ahead_s * np.sinc(rate * ahead_s / (2 * np.pi))
    return past_m[:, -1:] + length[..., None] * np.stack([np.cos(heading), np.sin(heading)], -1)
