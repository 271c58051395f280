#!/usr/bin/env python3
"""Attacks `sila serve` over loopback, one attack after another, while a good client sends ten pedestrians at 10 Hz over a connection of
its own and is measured. Exit code 1: the service ends, /metrics does not answer, a limit does not hold
or is not reported, memory passes its bound or does not come back, a line of the good client is rejected or not answered, or its 99 % are
over their bound, or `sila verify` finds something in the model file.

    tools/hostile_client.py                  # every attack in full, some minutes
    tools/hostile_client.py --short          # the same attacks, small: about 15 s
    tools/hostile_client.py --only long_lines  # one of them
"""

import argparse, json, multiprocessing, os, random, signal, subprocess, sys, tempfile, time

from hostile_attacks import ATTACKS, Attacks, FLOODING, PLACES, connect, detection, receive, http, rejections
from live_client import Service, Walkers, simulate, two_free_ports

TOKEN = "not-to-be-guessed"
MOST_MB = 400.0  # peak resident memory of the service
MOST_LEFT_MB = 150.0  # that it may have more at the end than at the beginning


def status_of(port, headers=b"", target=b"/metrics"):
    return (
        http(port, b"GET " + target + b" HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n" + headers + b"\r\n", 3.0)
        .split(b"\r\n")[0]
        .decode()
    )


def test_token(program, folder, scene, patience_s):
    """A service with a token that listens on all addresses: clients without the token are rejected, silent ones are closed."""
    model, port, report = os.path.join(folder, "token.sila"), two_free_ports(), []
    alone = subprocess.run(
        [program, "serve", "--scene", scene, "--model", model, "--http", "off", "--tcp", f"0.0.0.0:{port + 1}"],
        capture_output=True,
        text=True,
        timeout=20,
    )
    assert alone.returncode != 0 and "token" in alone.stderr, "listens beyond loopback without a token"
    secret = os.path.join(folder, "token")
    with open(secret, "w") as file:
        file.write(TOKEN + "\n")
    service = Service(program, scene, model, port, "--token-file", secret)
    try:
        assert service.up.wait(60), "did not start"
        for wrong in [
            b"",
            b"Authorization: Bearer \r\n",
            b"Authorization: Bearer not-to-be-guesse\r\n",
            b"Authorization: Bearer " + TOKEN.encode() + b"a\r\n",
        ]:
            assert "403" in status_of(port, wrong), wrong
        assert "200" in status_of(port, b"Authorization: Bearer " + TOKEN.encode() + b"\r\n")
        for first in [
            detection(1, "a"),
            b'{"token": ""}\n',
            b'{"token": "wrong"}\n',
            b'{"token": 5}\n',
            b"\n",
            b"[" * 100 + b"\n",
        ]:
            with connect(port + 1) as client:
                client.sendall(first)
                received, closed = receive(client, 3.0)
                assert closed and list(rejections(received)) == ["no_token"], (first, received, closed)
        report.append("wrong and missing tokens: 403, no_token")
        if patience_s:
            silent = [connect(port + 1) for _ in range(PLACES)]
            time.sleep(patience_s + 2.0)
            with connect(port + 1) as client:
                client.sendall(json.dumps({"token": TOKEN}).encode() + b"\n" + detection(1, "a", 1e30))
                counts = rejections(receive(client, 3.0)[0])
            assert "not_usable" in counts, f"{PLACES} without the token keep out the client that has it: {counts}"
            report.append(f"{PLACES} without the token are closed within {patience_s:g} s")
            for client in silent:
                client.close()
    finally:
        service.end(signal.SIGKILL)
    return "; ".join(report)


def elsewhere(act):
    """Runs `act` in a process of its own: in this one the interpreter would share its time between the attack and the good
    client, which would look like a delay of the service."""
    context = multiprocessing.get_context("fork")
    result, answer = context.Pipe(False)

    def run():
        try:
            answer.send((act(), None))
        except (AssertionError, OSError) as error:
            answer.send((None, repr(error)))

    process = context.Process(target=run)
    process.start()
    answer.close()
    try:
        report, breach = result.recv()
    except EOFError:
        report, breach = None, "the attack itself failed"
    process.join()
    return report, breach


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="build/release/cli/sila")
    parser.add_argument("--short", action="store_true")
    parser.add_argument("--only", help="attacks, separated by commas: " + ", ".join(ATTACKS + ["token"]))
    parser.add_argument(
        "--most-ms", type=float, default=1000.0, help="99 %% of the good client's delays, in each attack"
    )
    parser.add_argument(
        "--most-dropped",
        type=float,
        default=0.2,
        help="share of the good client's answers that may be superseded in an attack",
    )
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    program, port, chance = os.path.abspath(options.program), two_free_ports(), random.Random(options.seed)
    size = (lambda full, short: short) if options.short else (lambda full, short: full)
    calm_s = size(15.0, 1.0)  # of the good client alone, before and after
    wanted = options.only.split(",") if options.only else ATTACKS + ["token"]
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        paths, scene = simulate(program, folder, 200, options.seed)
        model = os.path.join(folder, "hostile.sila")
        service = Service(program, scene, model, port)
        if not service.up.wait(60):
            print("the service did not start", service.log, file=sys.stderr)
            return 1
        good = Walkers(port + 1, paths, 10, chance, due_s=3.25)
        attacks, marks = Attacks(port, size, chance), {}

        def measure(name, act):
            """Runs one attack and measures the good client."""
            service.reset_peak()
            begin, due, answered, dropped = time.monotonic(), good.due, good.due_answered, good.dropped
            made = service.metrics()["sila_predictions_total"]
            report, breach = elsewhere(act)
            if breach:
                report = f"BREACH: {breach}"
                faults.append(f"{name}: {breach}")
            end = time.monotonic()
            if not service.alive():
                print(f"== {name}: {report}\n   the service ended: {service.process.returncode}", flush=True)
                faults.append(f"{name}: the service ended: {service.process.returncode}, {service.log[-3:]}")
                return None
            time.sleep(size(1.2, 0.2))  # for pending answers, and counts that are reported once a second
            p50, p99 = (good.delay_ms(share, begin, end) for share in (0.5, 0.99))
            due, answered, dropped = good.due - due, good.due_answered - answered, good.dropped - dropped
            print(
                f"== {name}: {report}\n   {end - begin:.1f} s; good client: {due} due, {answered} answered, {dropped} superseded, half within {p50:.1f} ms, "
                f"99 % within {p99:.1f} ms; peak {service.peak_mb():.0f} MB, then {service.resident_mb():.0f} MB",
                flush=True,
            )
            if service.peak_mb() > MOST_MB:
                faults.append(f"{name}: {service.peak_mb():.0f} MB, more than {MOST_MB:g}")
            if due and not p99 <= options.most_ms:
                faults.append(f"{name}: 99 % of the good client within {p99:.0f} ms, more than {options.most_ms:g}")
            # Connections take turns: a client that needs less than a fair share gets all of it, one that needs more gets the share.
            share = (service.metrics()["sila_predictions_total"] - made) / (FLOODING + 1)
            if due and dropped > options.most_dropped * due and answered < 0.9 * share:
                faults.append(
                    f"{name}: {dropped} of {due} answers to the good client were superseded; {share:.0f} was its share"
                )
            if good.broken or good.rejected:
                faults.append(f"{name}: the good client was cut off or rejected: {good.broken}, {good.rejected}")
                good.rejected = {}
            try:
                service.metrics()
            except (OSError, ValueError) as error:
                time.sleep(1.0)
                faults.append(f"{name}: /metrics does not answer: {error}")
            marks[name] = service.resident_mb()
            return True

        going = measure("before", lambda: time.sleep(calm_s + 4.0))
        for name in wanted:
            if name != "token" and going:
                going = measure(name, getattr(attacks, name))
        if going:
            time.sleep(size(8.0, 0.2))
            measure("after", lambda: time.sleep(calm_s))
            left_mb = marks["after"] - marks["before"]
            if left_mb > MOST_LEFT_MB:
                faults.append(f"{left_mb:.0f} MB are left over, more than {MOST_LEFT_MB:g}")
            values = service.metrics()
            print(
                "rejected in total:",
                {
                    key.split('"')[1]: int(value)
                    for key, value in values.items()
                    if key.startswith("sila_rejected_total") and value
                },
                f"episodes {values['sila_episodes_total']:g}, failed {values['sila_episodes_failed_total']:g}",
            )
            if values["sila_episodes_failed_total"]:
                faults.append("an episode failed")
        good.stop(linger_s=3.0)
        faults += good.faults[:20]
        lost = good.due - good.due_answered - good.dropped
        print(
            f"good client: {good.sent} lines, {good.due} due, {good.due_answered} answered, {good.dropped} superseded, {lost} without an answer"
        )
        if good.due == 0:
            faults.append("no line of the good client was due: nothing was measured")
        if lost > 0:
            faults.append(f"{lost} lines of the good client have no answer")
        if service.alive():
            service.end(signal.SIGTERM)
            if service.process.returncode != 0:
                faults.append(f"exit code {service.process.returncode}: {service.log[-3:]}")
        if os.path.exists(model):
            verified = subprocess.run([program, "verify", model], capture_output=True, text=True)
            print("verify:", (verified.stdout or verified.stderr).strip())
            if verified.returncode != 0:
                faults.append(f"verify: {verified.stderr}")
        elif not options.short and not options.only:
            faults.append("nothing was learnt")
        if "token" in wanted:
            try:
                print("== token:", test_token(program, folder, scene, None if options.short else 10.0))
            except (AssertionError, OSError) as error:
                faults.append(f"token: {error!r}")
    print(f"{len(faults)} faults")
    return "\n".join(faults) or 0  # sys.exit prints a text on stderr and exits with 1


if __name__ == "__main__":
    sys.exit(main())
