"""Experiments: methods on scenes, trial by trial, in tables with intervals.

`sila experiment FILE --out DIR` runs one; docs/experiments.md describes the file and how a method is added.
Splits, windows and errors are those of the C++ library.
"""

from .experiment import Experiment
from .method import Forecast, Method, kernel_forecast, modes_sorted
from .read import read_experiment
from .runner import run_experiment

__all__ = [
    "Experiment",
    "Forecast",
    "Method",
    "kernel_forecast",
    "modes_sorted",
    "read_experiment",
    "run_experiment",
]
