#!/usr/bin/env python3
"""Loads `sila serve` over loopback as a tracker would: simulated pedestrians at 10 Hz, which it also learns. Prints, for each stage, the
latency of predictions (from sending a detection to reading its prediction) and the dropped and rejected lines.

    tools/load_test.py --stages 100:300                 # 100 pedestrians for 300 s
    tools/load_test.py --stages 100:60,1000:60,100:60   # too many, and back
"""
import argparse, csv, json, os, random, re, signal, socket, subprocess, sys, tempfile, threading, time, urllib.request


def simulate(program, folder, tracks, seed):
    path = os.path.join(folder, "simulated.csv")
    subprocess.run([program, "simulate", "--layout", "four-way", "--tracks", str(tracks), "--seed", str(seed), "--out", path],
                   check=True, capture_output=True)
    paths = {}
    with open(path) as file:
        for row in csv.DictReader(file):
            paths.setdefault(row["track_id"], []).append((float(row["t"]), float(row["x"]), float(row["y"])))
    return list(paths.values()), os.path.join(folder, "simulated.scene.json")


def at(path, t, k):
    """Position at t on a path, and the index to continue at."""
    while k + 2 < len(path) and path[k + 1][0] <= t:
        k += 1
    (t0, x0, y0), (t1, x1, y1) = path[k], path[k + 1]
    f = (t - t0) / (t1 - t0)
    return (x0 + f * (x1 - x0), y0 + f * (y1 - y0)), k


def write_stage(name, paths, people, seconds, rate, chance, together):
    """Writes the tracks of `people` pedestrians at a time, each followed by another at the same place."""
    rows = []
    for place in range(people):
        phase = 0.0 if together else chance.uniform(0, 1 / rate)
        frame = 0
        while frame / rate < seconds:
            path = chance.choice(paths)
            start, k, ident = path[0][0], 0, f"{place}-{frame}"
            if frame == 0:  # at the start pedestrians are anywhere on their path
                start += chance.uniform(0, 0.5 * (path[-1][0] - path[0][0]))
            length = path[-1][0] - start
            for n in range(int(length * rate)):
                t = (frame + n) / rate + phase
                if t >= seconds:
                    break
                (x, y), k = at(path, start + n / rate, k)
                rows.append((ident, t, x, y))
            frame += int(length * rate) + 1
    rows.sort(key=lambda row: row[1])
    with open(name, "w") as file:
        file.write("track_id,t,x,y\n")
        file.writelines(f"{i},{t:.4f},{x:.3f},{y:.3f}\n" for i, t, x, y in rows)


def resident_mb(pid):
    with open(f"/proc/{pid}/status") as file:
        return int(re.search(r"VmRSS:\s+(\d+)", file.read()).group(1)) / 1024


def metrics(port):
    text = urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=20).read().decode()
    return {line.rsplit(" ", 1)[0]: float(line.rsplit(" ", 1)[1]) for line in text.splitlines() if not line.startswith("#")}


def two_free_ports():
    """The first of two in a row, below those that systems give to clients."""
    while True:
        port = random.randrange(20000, 32000, 2)
        with socket.socket() as first, socket.socket() as second:
            try:
                first.bind(("127.0.0.1", port))
                second.bind(("127.0.0.1", port + 1))
            except OSError:
                continue
            return port


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stages", default="100:300", help="pedestrians:seconds, separated by commas")
    parser.add_argument("--program", default="build/release/cli/sila")
    parser.add_argument("--rate", type=float, default=10.0, help="detections of a pedestrian per second")
    parser.add_argument("--together", action="store_true", help="all pedestrians of a frame at the same moment; else spread over it")
    parser.add_argument("--port", type=int, help="of two in a row; free ones if none is given")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--model", help="model file to go on with")
    options = parser.parse_args()
    options.port = options.port or two_free_ports()
    program, chance = os.path.abspath(options.program), random.Random(options.seed)
    with tempfile.TemporaryDirectory() as folder:
        paths, scene = simulate(program, folder, 989, options.seed)
        stages = []
        for k, stage in enumerate(options.stages.split(",")):
            people, seconds = int(stage.split(":")[0]), float(stage.split(":")[1])
            name = os.path.join(folder, f"stage{k}.csv")
            write_stage(name, paths, people, seconds, options.rate, chance, options.together)
            stages.append((people, seconds, name))
        model = options.model or os.path.join(folder, "load.sila")
        service = subprocess.Popen([program, "serve", "--scene", scene, "--model", model, "--http", f"127.0.0.1:{options.port}",
                                    "--tcp", f"127.0.0.1:{options.port + 1}"], stderr=subprocess.PIPE, text=True)
        up = threading.Event()

        def listen():
            for line in service.stderr:
                if line.rstrip().endswith("serving"):
                    up.set()

        threading.Thread(target=listen, daemon=True).start()
        up.wait(60)
        for people, seconds, name in stages:
            before = metrics(options.port)
            player = subprocess.run([program, "replay", name, "--rate", "1", "--to", f"tcp:127.0.0.1:{options.port + 1}"],
                                    stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            after = metrics(options.port)
            gained = lambda key: int(after.get(key, 0) - before.get(key, 0))
            dropped = lambda reason: gained('sila_predictions_dropped_total{reason="' + reason + '"}')
            print(f"== {people} pedestrians at {options.rate:g} Hz for {seconds:g} s")
            print("".join(line + "\n" for line in player.stderr.splitlines() if "sent" in line or "detection to" in line or "sila" in line), end="")
            print(f"{gained('sila_detections_total')} detections, {gained('sila_predictions_total')} predictions, "
                  f"{dropped('superseded')} superseded, {dropped('slow_reader')} dropped for a slow reader, "
                  f"{gained('sila_predictions_scored_total')} scored, {gained('sila_predictions_not_retained_total')} not retained; "
                  f"{gained('sila_episodes_total')} episodes; {resident_mb(service.pid):.0f} MB resident", flush=True)
        service.send_signal(signal.SIGTERM)
        service.wait()
    return 0


if __name__ == "__main__":
    sys.exit(main())
