#!/usr/bin/env python3
"""Kills `sila serve` (SIGKILL) at random moments while it learns, and checks the model file each time: it must open and hold
every episode that was reported as stored, at most one more (stored, and killed before the report), and none twice.

    tools/kill_test.py --kills 200 [--program build/release/cli/sila] [--seed 1]
"""
import argparse, json, os, random, signal, sqlite3, subprocess, sys, tempfile, time

from live_client import Service

BATCH = 4  # tracks an episode
LONGEST_S = 2.5  # until a kill


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def check_file(program, model, reported):
    """Numbers and tracks of the episodes in the file, and its fault. `reported`: how many were reported as stored."""
    verified = subprocess.run([program, "verify", model], capture_output=True, text=True)
    # Killed within the transaction that creates the file: SQLite rolls back to an empty file.
    if not os.path.exists(model) or os.path.getsize(model) == 0:
        return [], "the model file is gone" if reported else None
    if verified.returncode != 0:
        return [], f"verify: {verified.stdout}{verified.stderr}"
    inspected = json.loads(run(program, "inspect", model, "--json"))
    with sqlite3.connect(f"file:{model}?mode=ro", uri=True) as database:
        rows = database.execute("SELECT number, tracks FROM episodes ORDER BY number").fetchall()
    numbers, fault = [number for number, _ in rows], None
    if numbers != list(range(1, len(numbers) + 1)):
        fault = f"the numbers of the episodes are {numbers}"
    elif not reported <= len(numbers) <= reported + 1:
        fault = f"{len(numbers)} episodes are in the file, {reported} were reported as stored"
    elif inspected["episodes"] != len(numbers):
        fault = f"the model has {inspected['episodes']} episodes, the file has {len(numbers)}"
    elif inspected["tracks"] != sum(tracks for _, tracks in rows):
        fault = f"the model has {inspected['tracks']} tracks, its episodes {sum(tracks for _, tracks in rows)}"
    return rows, fault


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--program", default="build/release/cli/sila")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    program, chance = os.path.abspath(options.program), random.Random(options.seed)
    busy, stored, unreported, failures = 0, 0, 0, []
    with tempfile.TemporaryDirectory() as folder:
        tracks, model = os.path.join(folder, "tracks.csv"), os.path.join(folder, "model.sila")
        socket = os.path.join(folder, "serve.sock")
        for kill in range(1, options.kills + 1):
            # New tracks each time: a batch that the model knows is no episode.
            seed = str(options.seed * 100000 + kill)
            run(program, "simulate", "--layout", "four-way", "--tracks", "100", "--seed", seed, "--out", tracks)
            service = Service(program, tracks.replace(".csv", ".scene.json"), model, None, "--unix", socket, "--batch", str(BATCH))
            if not service.up.wait(60):
                failures.append(f"kill {kill}: the service did not start again")
                break
            player = subprocess.Popen([program, "replay", tracks, "--apart", "0.4", "--rate", "60", "--to", "unix:" + socket],
                                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(chance.uniform(0.05, LONGEST_S))
            service.end(signal.SIGKILL)
            player.kill()
            player.wait()
            reported = max(service.stored, stored)
            rows, fault = check_file(program, model, reported)
            if fault:
                failures.append(f"kill {kill}: {fault}")
            busy += len(rows) > stored
            unreported += len(rows) == reported + 1
            stored = len(rows)
            if kill % 20 == 0:
                print(f"{kill} kills, {stored} episodes stored", file=sys.stderr)
    if stored == 0:
        failures.append("no episode was stored: nothing was tested")
    print(f"{options.kills} kills: {stored} episodes stored, new ones in {busy} of the runs, {unreported} killed between storing and reporting; "
          f"{len(failures)} faults")
    return "\n".join(failures) or 0  # sys.exit prints a text on stderr and exits with 1


if __name__ == "__main__":
    sys.exit(main())
