"""TrajEvo's heuristics (ai4co/trajevo, MIT, commit d30234e): that of the ETH/UCY scene, elsewhere that of univ; or, with
`baseline`, one of its baselines: "cvm", "ctrv" or "socialforce" (which needs pysocialforce)."""

import importlib.util
import logging

import numpy as np
from sila.experiments.sampler import Sampler, code_of

FILES = {"eth": "eth", "hotel": "hotel", "zara01": "zara1", "zara02": "zara2", "zara1": "zara1", "zara2": "zara2"}


def path_of(baseline, scene):
    if baseline:
        return code_of("trajevo", f"{baseline}/model.py") / "model.py"
    return code_of("trajevo", "zara2.py") / f"{FILES.get(scene, 'univ')}.py"


def heuristic_in(path):
    spec = importlib.util.spec_from_file_location("heuristic", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    logging.getLogger().setLevel(logging.WARNING)  # pysocialforce turns every library's debugging on
    return module.predict_trajectory


class TrajEvo(Sampler):
    upstream = "ai4co/trajevo", "d30234e", "trajevo"
    parameters = {"baseline": ""}

    @classmethod
    def require(cls, parameters):
        heuristic_in(path_of(parameters.get("baseline"), ""))

    def __init__(self, config="{}", **settings):
        super().__init__(config, **settings)
        path = path_of(self.baseline, self.scene)
        self.heuristic = heuristic_in(path)
        self.code_bytes = path.stat().st_size
        np.random.seed(self.seed)  # theirs draws from the global one

    @property
    def bytes(self):
        return self.code_bytes

    def sample(self, past_m, samples=20):
        drawn = [self.heuristic(past_m.copy()) for _ in range(-(-samples // 20))]
        return np.concatenate(drawn)[:samples]
