#!/usr/bin/env python3
"""One process learns into a model file, `sila learn` again and again, while another one reads it without a pause by
`sila inspect` and `sila predict`. Every reading must succeed and see whole episodes only: as many tracks as they have
together, their number never going back, and predictions whose weights sum to 1.

    tools/two_process_test.py --seconds 600 [--program build/release/cli/sila] [--seed 1]
"""
import argparse, json, os, subprocess, sys, tempfile, threading, time

BATCH = 5  # tracks an episode


def run(*command):
    return subprocess.run(command, capture_output=True, text=True)


def batches_of(tracks, folder, size):
    """The tracks in files of `size` tracks each."""
    with open(tracks) as file:
        header, *rows = file.read().splitlines()
    by_track = {}
    for row in rows:
        by_track.setdefault(row.split(",")[0], []).append(row)
    names, ids = [], list(by_track)
    for begin in range(0, len(ids), size):
        names.append(os.path.join(folder, f"batch{begin // size}.csv"))
        with open(names[-1], "w") as file:
            file.write("\n".join([header] + [row for track in ids[begin:begin + size] for row in by_track[track]]) + "\n")
    return names


class Reader:
    """What the reading process saw."""

    def __init__(self, program, scene, model, probe):
        self.inspect = [program, "inspect", model, "--json"]
        self.predict = [program, "predict", probe, "--scene", scene, "--model", model]
        self.readings, self.longest_s, self.seen, self.faults = 0, 0.0, [], []

    def once(self):
        for command in (self.inspect, self.predict):
            start = time.monotonic()
            done = run(*command)
            self.longest_s = max(self.longest_s, time.monotonic() - start)
            if done.returncode != 0:
                self.faults.append(f"{command[1]} failed: {done.stderr.strip()}")
                return
            self.look(json.loads(done.stdout)) if command is self.inspect else self.check(done.stdout.splitlines())
        self.readings += 1

    def look(self, report):
        now = (report["episodes"], report["tracks"])
        if self.seen and now < self.seen[-1]:
            self.faults.append(f"(episodes, tracks) went back from {self.seen[-1]} to {now}")
        if not self.seen or now != self.seen[-1]:
            self.seen.append(now)

    def check(self, lines):
        weights = [sum(mode["weight"] for mode in json.loads(line)["modes"]) for line in lines]
        if not weights or max(abs(weight - 1.0) for weight in weights) > 1e-6:
            self.faults.append(f"{len(weights)} predictions whose weights do not all sum to 1")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--program", default="build/release/cli/sila")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    program = os.path.abspath(options.program)
    with tempfile.TemporaryDirectory() as folder:
        tracks, model = os.path.join(folder, "tracks.csv"), os.path.join(folder, "model.sila")
        # Enough for the whole time: an episode takes more than a tenth of a second with its process.
        count = max(50, int(10 * options.seconds) * BATCH)
        subprocess.run([program, "simulate", "--layout", "four-way", "--tracks", str(count), "--seed", str(options.seed),
                        "--out", tracks], check=True, capture_output=True)
        scene = os.path.join(folder, "tracks.scene.json")
        batches = batches_of(tracks, folder, BATCH)
        learn = lambda batch: run(program, "learn", batch, "--scene", scene, "--model", model)
        after = {}  # episodes -> tracks, as the learner left them
        faults, stop = [], threading.Event()

        def note():
            report = json.loads(run(program, "inspect", model, "--json").stdout)
            after[report["episodes"]] = report["tracks"]

        learn(batches[0]), note()
        reader = Reader(program, scene, model, batches[0])

        def read():
            while not stop.is_set() and len(reader.faults) < 10:
                reader.once()

        thread = threading.Thread(target=read)
        thread.start()
        end = time.monotonic() + options.seconds
        learnt = 1
        for batch in batches[1:]:
            if time.monotonic() >= end or len(faults) >= 10:
                break
            done = learn(batch)
            if done.returncode != 0:
                faults.append("learn failed: " + done.stderr.strip().splitlines()[-1])
            learnt += 1
            note()
        stop.set()
        thread.join()
        faults += reader.faults
        faults += [f"{tracks} tracks in {episodes} episodes were read, never left by the learner"
                   for episodes, tracks in reader.seen if after.get(episodes) != tracks]
        if max(after) != learnt:
            faults.append(f"{learnt} episodes were learnt, the file has {max(after)}")
        if len(reader.seen) < 2:
            faults.append("the reader saw no episode come: nothing was tested")
        print(f"{options.seconds:g} s: {learnt} episodes learnt, {reader.readings} times read, {len(reader.seen)} different states seen, "
              f"longest reading {reader.longest_s:.2f} s, {os.path.getsize(model) / 1024:.0f} KB; {len(faults)} faults")
    return "\n".join(faults) or 0  # sys.exit prints a text on stderr and exits with 1


if __name__ == "__main__":
    sys.exit(main())
