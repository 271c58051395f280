"""A running service and simulated pedestrians, for the tools that try the service."""

import csv, json, math, os, random, re, socket, subprocess, threading, time, urllib.request

RATE_HZ = 10.0  # detections of a pedestrian
WEIGHT_TOLERANCE = 1e-9  # of the sum of weights from 1


def simulate(program, folder, tracks, seed):
    path = os.path.join(folder, "simulated.csv")
    command = [program, "simulate", "--layout", "four-way", "--tracks", str(tracks), "--seed", str(seed), "--out", path]
    subprocess.run(command, check=True, capture_output=True)
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


class Service:
    """A running service. `stored` is the number of the last episode that it reported as stored. Without a port it listens only where
    the options say."""

    def __init__(self, program, scene, model, port, *options):
        self.port, self.stored = port, 0
        self.log = []
        self.up = threading.Event()
        addresses = ["off"] if port is None else [f"127.0.0.1:{port}", "--tcp", f"127.0.0.1:{port + 1}"]
        command = [program, "serve", "--scene", scene, "--model", model, "--http", *addresses, *options]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        self.reader = threading.Thread(target=self.listen, daemon=True)
        self.reader.start()

    def listen(self):
        for line in self.process.stderr:
            self.log = (self.log + [line.rstrip()])[-200:]
            if stored := re.search(r"\bepisode (\d+) is stored", line):
                self.stored = int(stored[1])
            if line.rstrip().endswith("serving"):
                self.up.set()

    def alive(self):
        return self.process.poll() is None

    def resident_mb(self, field="VmRSS"):
        """Of a service that is gone: 0."""
        with open(f"/proc/{self.process.pid}/status") as file:
            found = re.search(rf"{field}:\s+(\d+)", file.read())
        return int(found[1]) / 1024 if found else 0.0

    def peak_mb(self):
        """The most since `reset_peak`."""
        return self.resident_mb("VmHWM")

    def reset_peak(self):
        with open(f"/proc/{self.process.pid}/clear_refs", "w") as file:
            file.write("5")

    def metrics(self):
        text = urllib.request.urlopen(f"http://127.0.0.1:{self.port}/metrics", timeout=20).read().decode()
        rows = (line.rsplit(" ", 1) for line in text.splitlines() if not line.startswith("#"))
        return {name: float(value) for name, value in rows}

    def end(self, signal):
        self.process.send_signal(signal)
        self.process.wait()
        self.reader.join(timeout=5)


def fault_of(prediction):
    """Why a prediction cannot be used, or None."""
    if not prediction["modes"]:
        return "no modes"
    if not 0.0 <= prediction["novelty"] <= 1.0:
        return f"novelty {prediction['novelty']}"
    if abs(sum(mode["weight"] for mode in prediction["modes"]) - 1.0) > WEIGHT_TOLERANCE:
        return "the weights do not sum to 1"
    times = prediction["t"]
    if not (times and times[0] > 0.0 and all(a < b for a, b in zip(times, times[1:]))):
        return "times do not increase"
    for mode in prediction["modes"]:
        if not len(times) == len(mode["x"]) == len(mode["y"]) == len(mode["cov"]):
            return "rows of different lengths"
        if not (mode["weight"] >= 0.0 and all(map(math.isfinite, mode["x"] + mode["y"]))):
            return "a number that is not finite"
        for xx, xy, yy in mode["cov"]:
            if not (math.isfinite(xx + yy) and xx > 0.0 and yy > 0.0 and xx * yy - xy * xy > 0.0):
                return f"the covariance {xx}, {xy}, {yy}"
    for region in prediction.get("regions", []):
        if not (
            0.0 < region["probability"] < 1.0
            and all(math.isfinite(level) and level >= 0.0 for level in region["level"])
        ):
            return "an invalid region"
    return None


class Walkers:
    """Sends `people` pedestrians at a time to a service over one connection, each followed by another at the same place, and checks
    everything that comes back. A line is due if its track is `due_s` old: it must be answered once, by a prediction or in a
    count of dropped ones."""

    def __init__(self, port, paths, people, chance, speed=1.0, due_s=math.inf, token=None):
        self.paths, self.chance, self.speed, self.due_s = paths, chance, speed, due_s
        self.sent_at = {}  # (id, t): when it was sent, and whether an answer is due
        self.sent, self.predictions, self.due, self.due_answered = 0, 0, 0, 0
        self.dropped, self.rejected, self.faults = 0, {}, []
        self.delays = []  # (when sent, s)
        self.broken, self.late_s = None, 0.0
        self.ending, self.lock = threading.Event(), threading.Lock()
        self.places = [None] * people
        self.names = 0
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=20)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if token:
            self.socket.sendall(json.dumps({"token": token}).encode() + b"\n")
        self.threads = [threading.Thread(target=work, daemon=True) for work in (self.walk, self.read)]
        for thread in self.threads:
            thread.start()

    def position(self, place, t):
        """Position of the pedestrian of a place, or of a new one."""
        now = self.places[place]
        if now is None or t - now["since"] + now["offset"] > now["path"][-1][0]:
            path = self.chance.choice(self.paths)
            offset = path[0][0]
            if now is None:  # at the start pedestrians are anywhere on their path
                offset += self.chance.uniform(0, 0.5 * (path[-1][0] - path[0][0]))
            self.names += 1
            now = self.places[place] = {
                "path": path,
                "offset": offset,
                "since": t,
                "k": 0,
                "id": f"{place}-{self.names}",
            }
        (x, y), now["k"] = at(now["path"], t - now["since"] + now["offset"], now["k"])
        return now, x, y

    def walk(self):
        begin, frame = time.monotonic(), 0
        try:
            while not self.ending.is_set():
                t = round(frame / RATE_HZ, 6)
                wait_s = begin + t / self.speed - time.monotonic()
                self.late_s = max(self.late_s, -wait_s)
                if wait_s > 0.0 and self.ending.wait(wait_s):
                    break
                lines = []
                for place in range(len(self.places)):
                    now, x, y = self.position(place, t)
                    due = t - now["since"] >= self.due_s
                    lines.append(f'{{"t": {t}, "id": "{now["id"]}", "x": {x:.4f}, "y": {y:.4f}}}\n')
                    with self.lock:
                        self.sent_at[now["id"], t] = (time.monotonic(), due)
                        self.due += due
                self.socket.sendall("".join(lines).encode())
                self.sent += len(lines)
                frame += 1
        except OSError as error:
            self.broken = self.broken or f"sending: {error}"
        self.played_s = frame / RATE_HZ

    def read(self):
        rest = b""
        try:
            self.socket.settimeout(None)
            while part := self.socket.recv(1 << 18):
                *lines, rest = (rest + part).split(b"\n")
                for line in lines:
                    self.take(line)
        except OSError as error:
            self.broken = self.broken or f"reading: {error}"
        self.broken = self.broken or "the service closed the connection"

    def take(self, line):
        now_s = time.monotonic()
        try:
            message = json.loads(line)
        except ValueError:
            return self.faults.append(f"no JSON: {line[:200]}")
        if "rejected" in message:
            self.rejected[message["rejected"]] = self.rejected.get(message["rejected"], 0) + message["count"]
        elif "dropped" in message:
            self.dropped += message["dropped"]
        else:
            self.predictions += 1
            with self.lock:
                sent_s, due = self.sent_at.pop((message.get("track"), message.get("t0")), (None, False))
                self.due_answered += due
                if len(self.sent_at) > 100000:  # lines that are not due are never answered
                    for key in list(self.sent_at)[:50000]:
                        del self.sent_at[key]
            if sent_s is None:
                return self.faults.append(
                    f"not requested, or answered twice: {message.get('track')} at {message.get('t0')}"
                )
            self.delays.append((sent_s, now_s - sent_s))
            fault = fault_of(message)
            if fault:
                self.faults.append(f"{fault}: {line[:300]}")

    def stop(self, linger_s=0.0):
        self.ending.set()
        self.threads[0].join()
        if linger_s:
            time.sleep(linger_s)
        self.broken = self.broken or ""  # from now on this side ends the connection
        try:
            self.socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        self.threads[1].join()
        self.socket.close()

    def delay_ms(self, share, since=-math.inf, until=math.inf):
        """Quantile of the delays of lines sent in this time."""
        sorted_s = sorted(delay for sent, delay in list(self.delays) if since <= sent < until)
        return 1e3 * sorted_s[min(len(sorted_s) - 1, int(share * len(sorted_s)))] if sorted_s else math.nan
