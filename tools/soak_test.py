#!/usr/bin/env python3
"""A long run of `sila serve`: simulated pedestrians walk at 20 times the speed, every prediction is checked, and about every minute the
service is killed (SIGKILL) at a random moment and started again. Nothing may be lost: each episode that was reported as stored is in
the file, none twice, and `sila verify` finds nothing. Nothing may grow without bound: the medians of resident memory and of the model
file in the last third of the time are at most --most-growth times those of the middle third.

    tools/soak_test.py --minutes 30 [--program build/release/cli/sila]
"""

import argparse, os, random, signal, statistics, sys, tempfile, time

from kill_test import check_file
from live_client import Service, Walkers, simulate, two_free_ports

PEOPLE = 10  # at a time
SPEED = 20.0  # times as fast as it happens
STRIDE_S = 1.0  # between predictions of a pedestrian
LIFE_S = 60.0  # from start to kill, on average
MOST_FAULTS_SHOWN = 20


def unaccounted(values):
    """Detections that no metric accounts for."""
    waiting = values.get("sila_predictions_due", 0)
    return (
        values["sila_detections_total"]
        - values["sila_detections_not_due_total"]
        - values["sila_predictions_total"]
        - waiting
        - values.get('sila_predictions_dropped_total{reason="superseded"}', 0)
    )


def growth(samples, key):
    """Medians of the middle and the last third of the time, and how many times as large the last is."""
    third = len(samples) // 3
    middle, last = (
        statistics.median(sample[key] for sample in part) for part in (samples[third : 2 * third], samples[2 * third :])
    )
    return middle, last, last / middle


def watch(service, walkers, model, until, samples, faults):
    """Samples the service until it is time to kill it."""
    while (left_s := until - time.monotonic()) > 0:
        time.sleep(min(1.0, left_s))
        if not service.alive() or walkers.broken:
            return faults.append(f"the service ended by itself: {walkers.broken}; {service.log[-3:]}")
        file_mb = os.path.getsize(model) / 1e6 if os.path.exists(model) else 0.0
        samples.append({"resident_mb": service.resident_mb(), "file_mb": file_mb})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--program", default="build/release/cli/sila")
    parser.add_argument(
        "--most-growth", type=float, default=1.25, help="last third over middle third, of memory and of the file"
    )
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    program, port, chance = os.path.abspath(options.program), two_free_ports(), random.Random(options.seed)
    total = dict.fromkeys(("lives", "kills", "sent", "predictions", "dropped", "unreported", "late"), 0)
    samples, faults, stored, delays = [], [], 0, []
    with tempfile.TemporaryDirectory() as folder:
        paths, scene = simulate(program, folder, 989, options.seed)
        model = os.path.join(folder, "soak.sila")
        begin = time.monotonic()
        end = begin + 60.0 * options.minutes
        while time.monotonic() < end and not (faults and total["kills"] == 0):
            service = Service(program, scene, model, port, "--every", str(STRIDE_S))
            if not service.up.wait(60):
                faults.append(f"life {total['lives'] + 1}: the service did not start: {service.log[-3:]}")
                service.end(signal.SIGKILL)
                break
            walkers = Walkers(port + 1, paths, PEOPLE, chance, speed=SPEED)
            total["lives"] += 1
            life_s = LIFE_S * chance.uniform(0.75, 1.25)
            until = min(time.monotonic() + life_s, end)
            before = len(faults)
            watch(service, walkers, model, until, samples, faults)
            try:
                values = service.metrics() if service.alive() else {}
            except OSError as error:
                values = {}
                faults.append(f"/metrics does not answer: {error}")
            if values and unaccounted(values) != 0:
                faults.append(f"no metric accounts for {unaccounted(values):g} detections")
            time.sleep(chance.uniform(0.0, 1.0))
            service.end(signal.SIGKILL)
            walkers.stop()
            total["kills"] += 1
            faults += walkers.faults[:MOST_FAULTS_SHOWN]
            if walkers.rejected:
                faults.append(f"lines of a good client were rejected: {walkers.rejected}")
            if walkers.predictions == 0:
                faults.append("nothing was predicted")
            rows, fault = check_file(program, model, max(service.stored, stored))
            if fault:
                faults.append(fault)
            total["unreported"] += len(rows) == max(service.stored, stored) + 1
            lived = len(rows) - stored
            stored = len(rows)
            for key in ("sent", "predictions", "dropped"):
                total[key] += getattr(walkers, key)
            total["late"] = max(total["late"], walkers.late_s)
            delays += [delay for _, delay in walkers.delays]
            print(
                f"life {total['lives']}, {(time.monotonic() - begin) / 60:.1f} min: {walkers.sent} lines at "
                f"{walkers.played_s / max(1e-9, life_s):.1f} x, {walkers.predictions} predictions ({walkers.dropped} superseded), "
                f"{lived} episodes, {stored} in the file; size {values.get('sila_model_size', 0):g}, "
                f"{values.get('sila_tracks_waiting', 0):g} tracks wait, {samples[-1]['resident_mb']:.0f} MB resident, "
                f"file {samples[-1]['file_mb']:.2f} MB",
                file=sys.stderr,
                flush=True,
            )
            faults[before:] = [f"life {total['lives']}: {fault}" for fault in faults[before:]]
    delays.sort()
    print(
        f"{options.minutes:g} min at {SPEED:g} x: {total['kills']} kills, {stored} episodes stored, {total['unreported']} killed between storing "
        f"and reporting; {total['sent']} lines, {total['predictions']} predictions checked, {total['dropped']} superseded; "
        f"99 % within {1e3 * delays[int(0.99 * len(delays))] if delays else 0:.0f} ms; the player was late by at most {total['late']:.2f} s"
    )
    for key, name in (("resident_mb", "resident memory"), ("file_mb", "model file")):
        if len(samples) < 6:
            faults.append("too few samples")
            break
        middle, last, times = growth(samples, key)
        print(
            f"{name}: median {middle:.2f} MB in the middle third, {last:.2f} MB in the last ({times:.2f} times), "
            f"most {max(sample[key] for sample in samples):.2f} MB"
        )
        if times > options.most_growth:
            faults.append(f"{name} grew {times:.2f} times, more than {options.most_growth:g}")
    print(f"{len(faults)} faults")
    return "\n".join(faults[:100]) or 0  # sys.exit prints a text on stderr and exits with 1


if __name__ == "__main__":
    sys.exit(main())
