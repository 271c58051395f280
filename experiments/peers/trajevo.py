"""TrajEvo's heuristics (ai4co/trajevo, MIT, commit d30234e): that of the ETH/UCY scene, elsewhere that of univ; or, with
`baseline`, one of its baselines: "cvm", "ctrv" or "socialforce" (which needs pysocialforce)."""

import importlib.util
import logging

import numpy as np
from sila.experiments.sampler import Sampler, code_of

code_of("trajevo", "zara2.py")  # raises where it is not there
FILES = {"eth": "eth", "hotel": "hotel", "zara01": "zara1", "zara02": "zara2", "zara1": "zara1", "zara2": "zara2"}


class TrajEvo(Sampler):
    upstream = "ai4co/trajevo", "d30234e", "trajevo"
    parameters = {"baseline": ""}

    def __init__(self, config="{}", **settings):
        super().__init__(config, **settings)
        named = f"{self.baseline}/model.py" if self.baseline else "zara2.py"
        path = code_of("trajevo", named) / ("model.py" if self.baseline else f"{FILES.get(self.scene, 'univ')}.py")
        spec = importlib.util.spec_from_file_location("heuristic", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        logging.getLogger().setLevel(logging.WARNING)  # pysocialforce turns every library's debugging on
        self.heuristic = module.predict_trajectory
        self.code_bytes = path.stat().st_size
        np.random.seed(self.seed)  # theirs draws from the global one

    @property
    def bytes(self):
        return self.code_bytes

    def sample(self, past_m, samples=20):
        drawn = [self.heuristic(past_m.copy()) for _ in range(-(-samples // 20))]
        return np.concatenate(drawn)[:samples]
