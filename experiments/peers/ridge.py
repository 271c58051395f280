"""Ridge regression on the observed positions."""

import numpy as np
from sila.experiments.gaussian_path import GaussianPath, heading_features, ridge

PENALTIES = 10.0 ** np.arange(-5, 5)


class Ridge(GaussianPath):
    def learn(self, past_m, deviation_m, person):
        weights, left_out = ridge(heading_features(past_m), deviation_m, person, PENALTIES)
        steps = deviation_m.shape[1]
        return lambda past: (heading_features(past) @ weights).reshape(len(past), steps, 2), left_out
