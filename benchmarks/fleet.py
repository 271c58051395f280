"""What a fleet costs: tracks a second with the engine and without it, and what its parts weigh.

    python benchmarks/fleet.py [--sites 4] [--tracks 250] [--partition 200] [--repeats 3]

needs the package with `sila[fleet]`. The places are simulated; the numbers are of this machine.
"""

import argparse
import os
import pickle
import statistics
import tempfile
import time
from pathlib import Path

import sila
import sila.fleet


class Done:
    """A future that has happened."""

    def __init__(self, value):
        self.value = value

    def result(self):
        return self.value

    def add_done_callback(self, function):
        function(self)


class Inline:
    """Does each task at once, in this process: the work without the engine."""

    def __init__(self):
        self.seconds = {}
        self.bytes = {}

    def submit(self, function, *arguments, key, pure):
        values = [argument.value if isinstance(argument, Done) else argument for argument in arguments]
        began = time.perf_counter()
        made = function(*values)
        step = key.split("-")[2]
        self.seconds.setdefault(step, []).append(time.perf_counter() - began)
        self.bytes.setdefault(step, []).append(len(pickle.dumps(made)))
        return Done(made)

    def gather(self, futures):
        return [future.value for future in futures]


def make_sites(folder, sites, tracks):
    layouts = ("four-way", "t-junction", "acute", "obtuse")
    for site in range(sites):
        place = folder / str(site)
        place.mkdir()
        made = sila.simulate(layout=layouts[site % 4], tracks=tracks, seed=site + 1)
        made.reported.save(place / "tracks.csv")
        made.scene.save(place / "scene.json")


def timed(action, repeats):
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        made = action()
        seconds.append(time.perf_counter() - began)
    return statistics.median(seconds), made


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, default in (("sites", 4), ("tracks", 250), ("partition", sila.fleet.PARTITION), ("repeats", 3)):
        parser.add_argument(f"--{name}", type=int, default=default)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        make_sites(folder, options.sites, options.tracks)
        run(folder, options)


def run(folder, options):
    def one_after_another():
        model = None
        for place in sorted(folder.iterdir()):
            tracks = sila.read_tracks(place / "tracks.csv", scene=place / "scene.json")
            model = sila.learn(tracks, scene=place / "scene.json", model=model, threads=1, progress=False)
        return model

    inline = Inline()
    rows = [("one after another, 1 thread", *timed(one_after_another, options.repeats))]
    rows.append(
        (
            "the fleet's tasks without the engine",
            *timed(lambda: sila.fleet.learn(folder, client=inline, partition=options.partition, progress=False).model, 1),
        )
    )
    for workers in (1, 2):
        with sila.fleet.local_client(workers) as client:
            client.wait_for_workers(workers)
            sila.fleet.learn(folder / "0", client=client, partition=options.partition, progress=False)  # imports are done
            seconds, outcome = timed(
                lambda client=client: sila.fleet.learn(folder, client=client, partition=options.partition, progress=False),
                options.repeats,
            )
            spent = ", ".join(f"{cpu:.1f}" for cpu in client.run(lambda: sum(os.times()[:2])).values())
            who = f"fleet, {workers} worker" + "s" * (workers > 1) + f" ({spent} s of processor time, with their start)"
            rows.append((who, seconds, outcome.model))
    assert rows[1][2] == rows[2][2] == rows[3][2], "one model, whoever made it"
    tracks = rows[0][2].tracks
    print(f"{options.sites} places of {options.tracks} tracks, {options.partition} tracks a partition\n")
    print("| who | s | tracks/s | size |\n| --- | --- | --- | --- |")
    for who, seconds, model in rows:
        print(f"| {who} | {seconds:.2f} | {tracks / seconds:.0f} | {model.size} |")
    print("\n| task | how many | ms each | s in all | KB that it makes |\n| --- | --- | --- | --- | --- |")
    for step, seconds in inline.seconds.items():
        kilobytes = statistics.mean(inline.bytes[step]) / 1000
        each = 1000 * statistics.mean(seconds)
        print(f"| {step} | {len(seconds)} | {each:.1f} | {sum(seconds):.2f} | {kilobytes:.0f} |")


if __name__ == "__main__":
    main()
