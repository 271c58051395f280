"""The table of an experiment in the field's protocol."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from .experiment import Settings
from .markdown import made_with, marked_texts, provenance, table_text
from .tables import bootstrap_pairs

SAMPLES = 100
MIXTURE_WINDOWS = 25  #: of which AMD and AMV are taken, as they fit a mixture to each step
LEARNT = {
    "in_place": "in place, 5 folds by track",
    "elsewhere": "on the other scenes",
    "published": "as published",
}
VALUES = {
    "ade_m": ("ADE", 3),
    "fde_m": ("FDE", 3),
    "min_ade_20_m": ("minADE20", 3),
    "min_fde_20_m": ("minFDE20", 3),
    "kde_nll": ("KDE-NLL", 2),
    "amd": ("AMD", 2),
    "amv": ("AMV", 3),
    "col_1": ("Col-I [%]", 1),
    "col_2": ("Col-II [%]", 1),
    "training_s": ("training [s of CPU]", 1),
    "bytes": ("bytes", 0),
}
PAIRED = ("ade_m", "min_ade_20_m", "kde_nll")


def markdown(file: str, settings: Settings, methods: Sequence[Any], results: Sequence[Any]) -> str:
    values = [_values(result) for result in results]
    table = pd.DataFrame(values).set_index(["scene", "method", "learnt"])
    reference = next((entry["name"], entry["learnt"]) for entry in methods if entry["cls"] is not None)
    made = made_with(entry["cls"] for entry in methods)
    text = [
        f"# {Path(file).stem}\n\n{provenance(made)}\n",
        "Eight positions seen, twelve predicted, 0.4 s apart; every run of twenty samples of one person is a window. "
        f"Metres and nats. ADE, FDE, Col: of the mean path; the others of {SAMPLES} samples, the best of the first 20. "
        "A sample of a mixture is one component for the whole path, and one standard normal vector that the covariance of "
        "each step scales. "
        f"AMD, AMV: on {MIXTURE_WINDOWS} windows a scene. In place: tracks of the same scene, another fold; published "
        "methods have not seen the scene, and draw people together. Training on one thread; in place the seconds of all "
        "folds. "
        f"Bold: better than {reference[0]}, {LEARNT[reference[1]]}.\n",
    ]
    mean = table.groupby(["method", "learnt"], sort=False).mean(numeric_only=True)
    text.append(_section("Mean over the scenes", mean, reference, methods))
    for scene in table.index.get_level_values("scene").unique():
        windows = int(table.loc[scene]["windows"].iloc[0])
        text.append(_section(f"{scene}, {windows} windows", table.loc[scene], reference, methods))
    text.append(_paired(results, reference, settings.bootstraps, settings.seed))
    return "\n".join(text)


def _values(result: Mapping[str, Any]) -> dict[str, Any]:
    sums = pd.DataFrame.from_dict(result["people"], orient="index").sum()
    found = {key: result[key] for key in ("scene", "method", "learnt")}
    found |= {key: np.nan if result[key] is None else result[key] for key in ("amd", "amv", "training_s", "bytes")}
    found |= {name: sums[name] / sums["windows"] for name in sums.index if name != "windows"}
    for name in ("col_1", "col_2"):
        found[name] *= 100
    return {**found, "windows": sums["windows"]}


def _section(title: str, table: pd.DataFrame, reference: tuple[str, str], methods: Sequence[Any]) -> str:
    keys = list(table.index)
    at = keys.index(reference)
    columns = [marked_texts(table[name].tolist(), decimals, at) for name, (_, decimals) in VALUES.items()]
    lines = [(method, [LEARNT[learnt], *row]) for (method, learnt), row in zip(keys, zip(*columns))]
    missing = [(f"{m['name']} (not run here)", ["–"] * (1 + len(VALUES))) for m in methods if m["cls"] is None]
    return f"## {title}\n\n{table_text('method', ['learnt', *(t for t, _ in VALUES.values())], [*lines, *missing])}"


def _paired(results: Sequence[Any], reference: tuple[str, str], bootstraps: int, seed: int) -> str:
    """Mean over the scenes of the differences from the reference, with intervals by resampling the people of each."""
    of = {(r["method"], r["learnt"], r["scene"]): r["people"] for r in results}
    scenes = list(dict.fromkeys(r["scene"] for r in results))
    lines = []
    for method, learnt in dict.fromkeys((r["method"], r["learnt"]) for r in results):
        if (method, learnt) == reference:
            continue
        cells = [LEARNT[learnt]]
        for measure in PAIRED:
            differences, spreads = [], []
            for i, scene in enumerate(scenes):
                own, other = of[method, learnt, scene], of[(*reference, scene)]
                pairs = [[own[p][measure], other[p][measure], own[p]["windows"]] for p in sorted(own)]
                difference, spread = bootstrap_pairs(np.array(pairs), bootstraps, seed + i)
                differences.append(difference)
                spreads.append(spread)
            low, high = np.quantile(np.mean(spreads, axis=0), [0.025, 0.975])
            text = f"{np.mean(differences):+.3f} ({low:+.3f} to {high:+.3f})"
            cells.append(f"**{text}**" if high < 0 else text)
        lines.append((method, cells))
    return (
        f"## Differences from {reference[0]}, {LEARNT[reference[1]]}\n\nMean over the scenes, 95 % interval by resampling "
        "the people of each scene; below 0 the method is better, bold where the whole interval is.\n\n"
        + table_text("method", ["learnt", *(VALUES[m][0] for m in PAIRED)], lines)
    )
