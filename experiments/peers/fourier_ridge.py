"""Ridge regression on the observed positions, and on what it leaves a second one on random Fourier features of place and
velocity: the least that learns a place. Source: Rahimi and Recht, "Random features for large-scale kernel machines"."""

import numpy as np
from sila.experiments.gaussian_path import GaussianPath, heading_features, ridge, to_heading
from sila.experiments.method import CONSTANT_VELOCITY_S

FEATURES = 700
SCALES = np.array([2.0, 2.0, 0.5, 0.5])  # m, m, m/s, m/s
PENALTIES, PLACE_PENALTIES = 10.0 ** np.arange(-5, 5), 10.0 ** np.arange(-2, 4.1, 0.5)


class FourierRidge(GaussianPath):
    def learn(self, past_m, deviation_m, person):
        random = np.random.default_rng(5)
        self.frequencies, self.phases = random.normal(size=(4, FEATURES)), random.uniform(0, 2 * np.pi, FEATURES)
        steps = deviation_m.shape[1]
        weights, left_out = ridge(heading_features(past_m), deviation_m, person, PENALTIES)
        rest = np.einsum("nba,ntb->nta", to_heading(past_m), deviation_m - left_out)  # of a place: world directions
        place_weights, place_left_out = ridge(self.features(past_m), rest, person, PLACE_PENALTIES)

        def deviation_of(past):
            kinematic = (heading_features(past) @ weights).reshape(len(past), steps, 2)
            place = (self.features(past) @ place_weights).reshape(len(past), steps, 2)
            return kinematic + np.einsum("nab,ntb->nta", to_heading(past), place)

        return deviation_of, left_out + np.einsum("nab,ntb->nta", to_heading(past_m), place_left_out)

    def features(self, past_m):
        back = round(CONSTANT_VELOCITY_S / self.interval_s)
        velocity = (past_m[:, -1] - past_m[:, -1 - back]) / CONSTANT_VELOCITY_S
        inputs = np.column_stack([past_m[:, -1], velocity]) / SCALES
        return np.cos(inputs @ self.frequencies + self.phases) * np.sqrt(2 / FEATURES)
