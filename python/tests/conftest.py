"""One small simulated intersection for all tests: what is learnt is learnt once."""

import matplotlib
import pytest
import sila

matplotlib.use("Agg")


@pytest.fixture(scope="session")
def place():
    """60 simulated tracks to learn from; an oblique corner, so that nothing is symmetric by accident."""
    return sila.simulate(layout="acute", tracks=60, seed=1)


@pytest.fixture(scope="session")
def unseen():
    return sila.simulate(layout="acute", tracks=25, seed=2)


@pytest.fixture(scope="session")
def model(place):
    return sila.learn(place.tracks, scene=place.scene, batch=20)


@pytest.fixture(scope="session")
def predictions(model, unseen):
    return sila.predict(model, unseen.tracks, scene=unseen.scene)
