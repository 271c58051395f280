"""Text of the tables of experiments, and what they were made with."""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import platform
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import _sila
from .method import Method
from .sampler import peers_folder
from .tables import BY_NAME


def number_text(value: float, decimals: int) -> str:
    return "–" if np.isnan(value) else f"{value:.{decimals}f}"


def table_text(first: str, titles: Sequence[str], rows: Sequence[tuple[str, Sequence[str]]]) -> str:
    lines = [f"| {' | '.join([first, *titles])} |", "|" + "---|" * (len(titles) + 1)]
    lines += [f"| {' | '.join([name, *cells])} |" for name, cells in rows]
    return "\n".join(lines) + "\n"


def bold_text(text: str, bold: bool) -> str:
    return f"**{text}**" if bold else text


def marked_texts(values: Sequence[float], decimals: int, reference: int, larger: bool = False) -> list[str]:
    """Bold where a value is better than the reference's as it is printed."""
    texts = [number_text(value, decimals) for value in values]
    marked = []
    for text, value in zip(texts, values):
        better = value > values[reference] if larger else value < values[reference]
        marked.append(bold_text(text, better and text != texts[reference]))
    return marked


def decimals_of(name: str) -> int:
    return BY_NAME[name].decimals if name in BY_NAME else 3


def provenance(made: Mapping[str, Any], details: str = "") -> str:
    """The revision, `details` and the versions, of what `made_with` gives."""
    versions = ", ".join(f"{name} {version}" for name, version in made["versions"].items())
    return f"Revision {made['revision']}; {details}{versions}."


def made_with(methods: Iterable[type[Method] | None]) -> dict[str, Any]:
    """The git revision of sila, and the versions of everything."""
    packages = "numpy scipy pandas matplotlib scikit-learn torch filterpy gpytorch linear-operator".split()
    versions = {"sila": _sila.version, "python": platform.python_version()}
    for package in packages:
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    versions |= dict(_checked(*cls.upstream) for cls in methods if cls is not None and cls.upstream)
    return {"revision": _sila.revision, "versions": versions, "machine": platform.machine()}


def _checked(repository: str, commit: str, name: str) -> tuple[str, str]:
    """A copy of the code that is no clone tells no commit."""
    folder = peers_folder() / name
    head = ""
    if (folder / ".git").exists():
        head = subprocess.run(["git", "-C", folder, "rev-parse", "HEAD"], capture_output=True, text=True).stdout.strip()
    if head and not head.startswith(commit):
        raise ValueError(f"experiment: {folder} is at {head[:7]}, expected {commit}; check that commit out")
    return repository, commit if head else f"{commit} (a copy, not checked)"


def hash_of(*values: Any) -> str:
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()[:16]


def build_hash() -> str:
    """Tells builds of one version apart: the extension module and the Python files of experiments."""
    files = [Path(_sila.__file__), *sorted(Path(__file__).parent.rglob("*.py"))]
    return hash_of([hashlib.sha256(file.read_bytes()).hexdigest() for file in files])


def kept_json(path: Path) -> dict[str, Any]:
    """The object of a file; an empty one of what is no JSON object, such as half a file."""
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return {}
    return kept if isinstance(kept, dict) else {}


def write_text(path: Path, text: str) -> None:
    """In one step, so that an interruption leaves no half file."""
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)
