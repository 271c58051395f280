#!/usr/bin/env python3
"""Loads `sila serve` over loopback as a tracker would: simulated pedestrians at 10 Hz, which it also learns. Prints, for each stage, the
latency of predictions (from sending a detection to reading its prediction) and the dropped and rejected lines.

    tools/load_test.py --stages 100:300                 # 100 pedestrians for 300 s
    tools/load_test.py --stages 100:60,1000:60,100:60   # too many, and back
"""
import argparse, os, random, signal, subprocess, sys, tempfile

from live_client import RATE_HZ, Service, at, simulate, two_free_ports


def write_stage(name, paths, people, seconds, chance):
    """Writes the tracks of `people` pedestrians at a time, each followed by another at the same place."""
    rows = []
    for place in range(people):
        phase = chance.uniform(0, 1 / RATE_HZ)
        frame = 0
        while frame / RATE_HZ < seconds:
            path = chance.choice(paths)
            start, k, ident = path[0][0], 0, f"{place}-{frame}"
            if frame == 0:  # at the start pedestrians are anywhere on their path
                start += chance.uniform(0, 0.5 * (path[-1][0] - path[0][0]))
            length = path[-1][0] - start
            for n in range(int(length * RATE_HZ)):
                t = (frame + n) / RATE_HZ + phase
                if t >= seconds:
                    break
                (x, y), k = at(path, start + n / RATE_HZ, k)
                rows.append((ident, t, x, y))
            frame += int(length * RATE_HZ) + 1
    rows.sort(key=lambda row: row[1])
    with open(name, "w") as file:
        file.write("track_id,t,x,y\n")
        file.writelines(f"{i},{t:.4f},{x:.3f},{y:.3f}\n" for i, t, x, y in rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stages", default="100:300", help="pedestrians:seconds, separated by commas")
    parser.add_argument("--program", default="build/release/cli/sila")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    program, port, chance = os.path.abspath(options.program), two_free_ports(), random.Random(options.seed)
    with tempfile.TemporaryDirectory() as folder:
        paths, scene = simulate(program, folder, 989, options.seed)
        stages = []
        for k, stage in enumerate(options.stages.split(",")):
            people, seconds = int(stage.split(":")[0]), float(stage.split(":")[1])
            name = os.path.join(folder, f"stage{k}.csv")
            write_stage(name, paths, people, seconds, chance)
            stages.append((people, seconds, name))
        service = Service(program, scene, os.path.join(folder, "load.sila"), port)
        service.up.wait(60)
        for people, seconds, name in stages:
            before = service.metrics()
            player = subprocess.run([program, "replay", name, "--rate", "1", "--to", f"tcp:127.0.0.1:{port + 1}"],
                                    stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            after = service.metrics()
            gained = lambda key: int(after.get(key, 0) - before.get(key, 0))
            dropped = lambda reason: gained('sila_predictions_dropped_total{reason="' + reason + '"}')
            print(f"== {people} pedestrians at {RATE_HZ:g} Hz for {seconds:g} s")
            print("".join(line + "\n" for line in player.stderr.splitlines() if "sent" in line or "detection to" in line or "sila" in line), end="")
            print(f"{gained('sila_detections_total')} detections, {gained('sila_predictions_total')} predictions, "
                  f"{dropped('superseded')} superseded, {dropped('slow_reader')} dropped for a slow reader, "
                  f"{gained('sila_predictions_scored_total')} scored, {gained('sila_predictions_not_retained_total')} not retained; "
                  f"{gained('sila_episodes_total')} episodes; {service.resident_mb():.0f} MB resident", flush=True)
        service.end(signal.SIGTERM)
    return 0


if __name__ == "__main__":
    sys.exit(main())
