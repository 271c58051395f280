"""`sila fleet`: data on stdout, messages on stderr; exit 0: done, 1: bad input, 2: wrong usage."""

from __future__ import annotations

import argparse
import contextlib
import json
import logging
import os
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import fleet
from ._config import assignments
from ._rows import counted, print_warning
from ._sila import Model
from .errors import FormatError, failed

if TYPE_CHECKING:
    from distributed import Client

EXAMPLE = "example: sila fleet sites/ --model city.sila --workers 2"


def run(arguments: list[str]) -> int:
    parser = _parser()
    if "" in arguments:
        parser.error("expected a value, found an empty one")
    options = parser.parse_args(arguments)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = print_warning
            outcome = _learn(options)
    except (ValueError, TypeError, ImportError, OSError, RuntimeError, KeyboardInterrupt) as error:
        return failed(error, "nothing was written")
    for path, reason in outcome.unread.items():
        print(f"{path}: left out: {reason}", file=sys.stderr)
    if options.json:
        print(json.dumps(_summary(options, outcome), indent=2))
    else:
        model = outcome.model
        print(
            f"{options.model}: {counted(outcome.tracks, 'new track')}, {model.tracks} in "
            f"{counted(model.episodes, 'episode')}, {counted(len(model.primitives), 'primitive')}, "
            f"{counted(len(model.transitions), 'transition')}; {counted(outcome.partitions, 'partition')} of "
            f"{counted(outcome.sources, 'source')}, {counted(outcome.known_episodes, 'episode')} known before, "
            f"{outcome.seconds:.1f} s"
        )
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="sila fleet",
        description="Learn many sources in parallel on dask.distributed and fuse the models into one.",
        epilog=EXAMPLE,
    )
    add = parser.add_argument
    add("sources", nargs="+", metavar="SOURCE", help="track files, model files (*.sila), folders of them")
    add("--model", required=True, metavar="M.sila", help="model file to create or to update")
    usual = "the one beside each; else a frame made from the first tracks"
    add("--scene", metavar="S.json", help=f"scene of all sources [{usual}]")
    add("--batch", type=_count, default=20, metavar="N", help="tracks per episode [20]")
    add("--partition", type=_count, default=fleet.PARTITION, metavar="N", help=f"tracks per task [{fleet.PARTITION}]")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=_count, metavar="N", help="processes on this machine [one per processor]")
    where.add_argument("--scheduler", metavar="ADDRESS", help="address of a running Dask scheduler, tcp://...:8786")
    add("--strict", action="store_true", help="stop if a source cannot be read, before anything is learnt")
    add("--config", metavar="FILE", help="JSON file with configuration")
    add("--set", action="append", default=[], metavar="PATH=VALUE", help="one configuration field; see `sila config`")
    add("--json", action="store_true", help="print the result as JSON")
    return parser


def _count(text: str) -> int:
    with contextlib.suppress(ValueError):
        if int(text) > 0:
            return int(text)
    raise argparse.ArgumentTypeError(f"expected a whole number of at least 1, found {text}")


def _learn(options: argparse.Namespace) -> fleet.Outcome:
    path = Path(options.model)
    start = Model.load(path) if path.exists() else Model()
    if not path.parent.is_dir():
        raise FormatError(str(path), 0, "a model file that can be written", "no such folder")
    with _client(options) as client:
        outcome = fleet.learn(
            options.sources,
            scene=options.scene,
            model=start,
            client=client,
            batch=options.batch,
            partition=options.partition,
            config=assignments(options.config, options.set),
            strict=options.strict,
        )
    if outcome.tracks > 0:
        # What another process learnt into the file since the start would be lost.
        if path.exists() and Model.load(path) != start:
            raise RuntimeError(f"{path} has changed since this run began; nothing was written, run the command again")
        outcome.model.save(path)
    return outcome


@contextlib.contextmanager
def _client(options: argparse.Namespace) -> Iterator[Client]:
    if options.scheduler is not None:
        with fleet.engine().Client(options.scheduler) as client:
            yield client
        return
    logging.getLogger("asyncio").setLevel(logging.CRITICAL)  # it tells of each task that an interrupt cancels
    with fleet.local_client(options.workers) as client:
        yield client


def _summary(options: argparse.Namespace, outcome: fleet.Outcome) -> dict[str, Any]:
    return {
        "model": os.fspath(options.model),
        "sources": outcome.sources,
        "unread": outcome.unread,
        "partitions": outcome.partitions,
        "known_episodes": outcome.known_episodes,
        "tracks": outcome.tracks,
        "size": outcome.model.size,
        "seconds": outcome.seconds,
    }
