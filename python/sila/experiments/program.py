"""`sila experiment`: data on stdout, messages on stderr; exit 0: done, 1: bad input, 2: wrong usage."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from .. import _sila
from .._config import assignments
from ..errors import FormatError, UsageError, failed
from .experiment import Overrides
from .read import RANGES, SPLITS, read_experiment
from .runner import run_experiment

EXAMPLE = "example: sila experiment experiments/smoke.json --out out/smoke"


def run(arguments: list[str]) -> int:
    options = _parser().parse_args(arguments)
    try:
        if options.workers < 1:
            raise UsageError(f"--workers: expected at least 1, found {options.workers}")
        if options.threads < 0:
            raise UsageError(f"--threads: expected at least 0, found {options.threads}")
        for name in ("trials", "seed"):
            value, (low, high) = getattr(options, name), RANGES[name]
            if value is not None and not low <= value <= high:
                raise UsageError(f"--{name}: expected {low:g} to {high:g}, found {value}")
        if Path(options.out).is_file():
            raise FormatError(options.out, 0, "a folder for the results (--out)", "a file")
        _sila.limit_threads(options.threads)
        config = assignments(options.config, options.set)
        whole = json.loads(_sila.config_from_file(options.file))
        if isinstance(whole, dict) and whole.get("kind") == "field":
            from .field import run_field

            _reject_unused(options)
            run_field(options.file, options.out, options.data_dir)
            print(f"results in {Path(options.out) / 'table.md'}; predictions in trajnet/", file=sys.stderr)
            return 0
        overrides = Overrides(options.trials, options.split, options.seed, options.data_dir, config)
        experiment = read_experiment(options.file, overrides)
        written = run_experiment(experiment, options.out, redo=options.redo, workers=options.workers)
        if options.plots or options.png:
            from .plots import draw

            for path in draw(Path(options.out), png=options.png):
                print(path, file=sys.stderr)
    except (ValueError, TypeError, ImportError, OSError, RuntimeError, KeyboardInterrupt) as error:
        return failed(error, "repeat the command to continue")
    for name, reason in written["not_run_here"].items():
        print(f"{name}: not run here: {reason}", file=sys.stderr)
    if options.json:
        print(json.dumps(written["summary"], indent=2))
    print(f"results in {Path(options.out) / 'table.md'}, results.json, results.csv, curves.csv", file=sys.stderr)
    return 0


def _reject_unused(options: argparse.Namespace) -> None:
    """Raises UsageError for what an experiment of the kind "field" does not read."""
    without = vars(_parser().parse_args([options.file, "--out", options.out]))
    for name, value in vars(options).items():
        if name not in ("data_dir", "threads") and value != without[name]:
            raise UsageError(f"--{name}: has no effect on an experiment of the kind field; leave it out")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="sila experiment",
        description="Compare methods on scenes, trial by trial; the same command continues an interrupted experiment.",
        epilog=EXAMPLE,
    )
    add = parser.add_argument
    add("file", metavar="FILE", help="experiment file (docs/experiments.md)")
    add("--out", required=True, metavar="DIR", help="folder for the results; finished runs in it are kept")
    add("--data-dir", metavar="DIR", help="also look here for scene files and the files that they name")
    add("--trials", type=int, metavar="N", help="overrides the file")
    add("--split", choices=SPLITS, help="overrides the file")
    add("--redo", action="store_true", help="repeat the runs of another configuration or build")
    add("--workers", type=int, default=1, metavar="N", help="processes that do runs in parallel [1]")
    add("--plots", action="store_true", help="also draw figures (needs matplotlib)")
    add("--png", action="store_true", help="also draw figures, as SVG and PNG")
    add("--config", metavar="FILE", help="JSON file with configuration for all scenes")
    add("--set", action="append", default=[], metavar="PATH=VALUE", help="one configuration field; see `sila config`")
    add("--threads", type=int, default=0, metavar="N", help="threads of the library; 0: one per processor [0]")
    add("--seed", type=int, metavar="N", help="seed of the first trial; overrides the file")
    add("--json", action="store_true", help="print the summary as JSON")
    return parser
