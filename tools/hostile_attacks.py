"""Attacks of a hostile client on `sila serve`, one a method, and their sockets. Each returns the answer of the service;
tools/hostile_client.py runs them and checks the limits."""

import base64, json, os, selectors, socket, struct, time

PLACES = 64  # service.max_connections
LINE = 16384  # service.max_line_bytes
FLOODING = 8  # connections at once that need more predictions than can be made


def connect(port, timeout_s=10.0):
    client = socket.create_connection(("127.0.0.1", port), timeout=timeout_s)
    client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return client


def receive(client, seconds):
    """Bytes received within `seconds`, or until the service closes the connection; and whether it did."""
    received, until = b"", time.monotonic() + seconds
    while (left_s := until - time.monotonic()) > 0:
        client.settimeout(left_s)
        try:
            part = client.recv(1 << 16)
        except TimeoutError:
            break
        except OSError:
            return received, True
        if not part:
            return received, True
        received += part
    return received, False


def send(client, data, seconds):
    """Sends as much as is accepted within `seconds`, without reading; returns the number of bytes."""
    sent, until, data = 0, time.monotonic() + seconds, memoryview(data)
    while sent < len(data) and (left_s := until - time.monotonic()) > 0:
        client.settimeout(left_s)
        try:
            sent += client.send(data[sent : sent + (1 << 18)])
        except OSError:
            break
    return sent


def receive_rejections(client, seconds):
    """Rejections as soon as they are reported (once a second), within `seconds`."""
    received, until = b"", time.monotonic() + seconds
    while time.monotonic() < until:
        part, closed = receive(client, 0.15)
        received += part
        if closed or (not part and rejections(received)):
            break
    return rejections(received)


def rejections(received):
    """Numbers of rejected and dropped lines by reason."""
    counts = {}
    for line in received.split(b"\n"):
        if line.startswith(b'{"rejected"') or line.startswith(b'{"dropped"'):
            message = json.loads(line)
            reason = message.get("rejected", "dropped")
            counts[reason] = counts.get(reason, 0) + message.get("count", message.get("dropped"))
    return counts


def detection(t, ident, x=0.0, y=0.0, more=""):
    return f'{{"t":{t:.6f},"id":"{ident}","x":{x:.3f},"y":{y:.3f}{more}}}\n'.encode()


def http(port, request, seconds=5.0):
    with connect(port) as client:
        send(client, request, seconds)
        return receive(client, seconds)[0]


def handshake(port, path="/stream"):
    client = connect(port)
    key = base64.b64encode(os.urandom(16)).decode()
    client.sendall(
        f"GET {path} HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n"
        "Sec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    answer = b""
    while b"\r\n\r\n" not in answer:
        part = client.recv(4096)
        if not part:
            raise OSError("the service closed the connection in the handshake")
        answer += part
    return client


def frame(payload, first=0x81, mask=True, length=None):
    """A frame of a WebSocket, valid or not."""
    length, bit = len(payload) if length is None else length, 0x80 if mask else 0
    head = bytes([first]) + (
        bytes([bit | length])
        if length < 126
        else bytes([bit | 126]) + struct.pack(">H", length)
        if length < 65536
        else bytes([bit | 127]) + struct.pack(">Q", length)
    )
    return head + (b"\0\0\0\0" if mask else b"") + payload


class Attacks:
    """Each returns the attack and its answer, and raises AssertionError with a broken promise."""

    def __init__(self, port, size, chance):
        self.http, self.lines, self.size, self.chance = port, port + 1, size, chance

    def expect(self, data, expected):
        """Sends lines that must be rejected for one of the expected reasons."""
        with connect(self.lines) as client:
            assert send(client, data, 300.0) == len(data), "not all of it was accepted"
            counts = receive_rejections(client, 3.0)
        assert counts and set(counts) <= set(expected), f"rejected as {counts}, not as {expected}"
        return f"rejected: {counts}"

    def hold(self, port, count, opening, seconds, drip):
        """Opens `count` connections that send a byte per second; returns how many are closed and how many stay open."""
        clients, rejected, closed = [], 0, 0
        for _ in range(count):
            try:
                client = connect(port, 2.0)
                client.sendall(opening)
                clients.append(client)
            except OSError:
                rejected += 1
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            time.sleep(1.0)
            for client in list(clients):
                try:
                    client.setblocking(False)
                    client.send(drip)
                    if not client.recv(4096):
                        raise ConnectionError
                except BlockingIOError:
                    continue
                except OSError:
                    closed += 1
                    clients.remove(client)
        for client in clients:
            client.close()
        return rejected + closed, len(clients)

    def slow_http(self):
        """Half a request and a byte per second on every connection."""
        seconds = self.size(34, 2)
        gone, left = self.hold(
            self.http, PLACES + 20, b"GET /metrics HTTP/1.1\r\nHost: localhost\r\nX-Slow: ", seconds, b"a"
        )
        assert gone >= 15 and (seconds < 31 or left == 0), f"{left} still open after {seconds} s"
        return f"{PLACES + 20} connections, {gone} closed within {seconds} s, {left} left"

    def slow_lines(self):
        """Half a line and a byte per second."""
        gone, left = self.hold(self.lines, PLACES + 20, b'{"t": 1, "id": "', self.size(15, 2), b"a")
        assert gone >= 15, f"only {gone} turned away"
        return f"{PLACES + 20} connections, {gone} turned away, {left} left"

    def endless_line(self):
        size = self.size(100 << 20, 4 << 20)
        with connect(self.lines) as client:
            assert send(client, b"a" * size, 120.0) == size, "not all of it was accepted"
            counts = receive_rejections(client, 3.0)
            assert set(counts) == {"too_long"}, counts
        return f"{size >> 20} MB without an end: rejected {counts}"

    def long_lines(self):
        exact, over = (
            b'{"t":1,"id":"1","x":0,"y":0,"label":"' + b"a" * (size - 39) + b'"}\n' for size in (LINE, LINE + 1)
        )
        assert len(exact) == LINE + 1
        with connect(self.lines) as client:
            client.sendall(exact)
            assert "too_long" not in receive_rejections(client, 1.5), "a line of the limit is too long"
        return self.expect(over * self.size(10000, 500), {"too_long"}) + f" ({LINE + 1} bytes; {LINE} are taken)"

    def deep_json(self):
        deep = self.expect(b"[" * 100000 + b"]" * 100000 + b"\n", {"too_long"})
        short = (b'{"id":' * 600 + b"\n") + b"[" * 4000 + b"\n" + b'{"t":1,"id":' + b"[" * 2000 + b"]" * 2000 + b"}\n"
        return (
            deep
            + "; below the limit of a line "
            + self.expect(short * self.size(2000, 50), {"not_json", "not_a_detection"})
        )

    def wrong_utf8(self):
        wrong = [b"\xff", b"\xc0\xaf", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\xe2\x82", b"\x80"]
        lines = b"".join(b'{"t":1,"id":"' + bad + b'","x":0,"y":0}\n' for bad in wrong)
        return self.expect(lines * self.size(1000, 50), {"not_json"})

    def nul_and_noise(self):
        nul = self.expect(b'{"t":1,"id":"a\0b","x":0,"y":0}\n' + b"\0" * 100 + b"\n", {"not_json"})
        noise = self.chance.randbytes(self.size(5000000, 200000)).replace(b"\n", b"\n\r\n")
        return nul + "; noise " + self.expect(noise, {"not_json", "too_long", "too_fast", "not_a_detection"})

    def absurd_numbers(self):
        numbers = f'1e400 -1e400 1e308 -1e308 1e13 NaN Infinity {"1" * 400} -0 1e-400 true null "1" []'.split()
        lines = "".join(
            f'{{"t":{n if k == 0 else 0},"id":"n","x":{n if k == 1 else 0},"y":{n if k == 2 else 0}}}\n'
            for n in numbers
            for k in range(3)
        )
        ids = "".join(
            f'{{"t":0,"id":{n},"x":0,"y":0}}\n'
            for n in ["1e400", "1" * 400, "1.5", '""', '"' + "a" * 65 + '"', "null", "{}"]
        )
        return self.expect(
            (lines + ids).encode() * self.size(300, 10),
            {"not_json", "not_a_detection", "not_usable", "off_clock", "late"},
        )

    def many_ids(self):
        count = self.size(100000, 5000)
        with connect(self.lines) as client:
            received = b""
            for begin in range(0, count, 5000):
                send(client, b"".join(detection(1.0, n, n % 50) for n in range(begin, begin + 5000)), 20.0)
                received += receive(client, 0.4)[0]
            counts = rejections(received + receive(client, 1.5)[0])
        taken = count - sum(counts.values())
        assert (
            set(counts) <= {"too_many_ids", "too_fast", "overloaded"}
            and counts.get("too_many_ids", 0) > 0
            and taken <= 2000
        ), counts
        return f"{count} ids: {taken} taken, rejected {counts}"

    def flood(self, line_of, count, clients=1):
        """`count` lines as fast as possible, from one or many connections, without reading an answer until the end."""
        connections = [connect(self.lines) for _ in range(clients)]
        selector = selectors.DefaultSelector()
        state = {}
        for c, client in enumerate(connections):
            client.setblocking(False)
            selector.register(client, selectors.EVENT_WRITE)
            state[client] = [b"", 0, c]
        begin, open_ = time.monotonic(), set(connections)
        while open_ and time.monotonic() < begin + 300:
            for key, _ in selector.select(1.0):
                client = key.fileobj
                waiting, said, c = state[client]
                if not waiting and said < count // clients:
                    waiting = b"".join(line_of(n, c) for n in range(said, min(said + 2000, count // clients)))
                    said += 2000
                if not waiting:
                    selector.unregister(client)
                    open_.discard(client)
                    continue
                try:
                    waiting = waiting[client.send(waiting) :]
                except BlockingIOError:
                    pass
                except OSError:
                    waiting, said = b"", count
                state[client] = [waiting, said, c]
        seconds, received = time.monotonic() - begin, {}
        for client in connections:
            for reason, number in rejections(receive(client, self.size(2.0, 1.1) if clients == 1 else 0.2)[0]).items():
                received[reason] = received.get(reason, 0) + number
            client.close()
        assert not open_, "the service stopped reading"
        return f"{count} lines from {clients} in {seconds:.1f} s; reported {received}"

    def flood_of_one(self):
        return self.flood(lambda n, c: b'{"t":1,"id":"1","x":0,"y":0}\n', self.size(1000000, 50000))

    def flood_of_walkers(self):
        """2000 ids that walk, far more than can be predicted, from 8 connections at once."""
        return self.flood(
            lambda n, c: detection(0.1 * (n // 2000), n % 2000, 0.1 * (n // 2000), n % 50),
            self.size(1000000, 100000),
            clients=self.size(FLOODING, 2),
        )

    def flood_of_leaps(self):
        """A track that leaps at each line, so that its path is cleaned again each time."""
        return self.flood(lambda n, c: detection(1e-4 * n, "leaps", 1000.0 * (n % 2)), self.size(200000, 20000))

    def flood_of_labels(self):
        """Lines of almost the limit, each with a label that need not be kept."""
        label = ',"label":"pedestrian' + "a" * (LINE - 120) + '"'
        return self.flood(
            lambda n, c: detection(0.1 * (n // 500), n % 500, 0.1 * (n // 500), n % 50, label), self.size(200000, 20000)
        )

    def many_connections(self):
        count, clients, turned_away = self.size(5000, 300), [], 0
        for _ in range(count):
            client = connect(self.lines)
            clients.append(client)
            if len(clients) > 500:
                clients.pop(0).close()
        time.sleep(1.0)
        for client in clients:
            received, _ = receive(client, 0.002)
            turned_away += b"too_many_connections" in received
            client.close()
        assert turned_away > 0, "no connection was turned away"
        return f"{count} connections; of the last {len(clients)} {turned_away} got too_many_connections"

    def websockets(self):
        answers = []
        bad = {
            "not masked": frame(b"{}", mask=False),
            "reserved bits": frame(b"{}", first=0xF1),
            "unknown kind": frame(b"{}", first=0x83),
            "continues nothing": frame(b"{}", first=0x80),
            "2^63 bytes": frame(b"", length=(1 << 63)),
            "wrong UTF-8": frame(b"\xff\xfe"),
            "long ping": frame(b"a" * 200, first=0x89),
            "bad close": frame(b"\x00", first=0x88),
            "1 MB": frame(b"a" * (1 << 20)),
            "noise": self.chance.randbytes(2000),
        }
        for name, data in bad.items():
            with handshake(self.http) as client:
                send(client, data, 5.0)
                received, closed = receive(client, 5.0)
                at = received.rfind(b"\x88")
                code = struct.unpack(">H", received[at + 2 : at + 4])[0] if 0 <= at <= len(received) - 4 else None
                assert closed or (name == "noise" and not received), f"{name}: goes on after {received[:100]}"
                assert code in (None, 1002, 1007, 1009), f"{name}: closed with {code}"
                answers.append(f"{name}: {code or 'closed the connection'}")
        with handshake(self.http) as client:  # a message in frames of a byte, without an end
            send(client, frame(b"a", first=0x01) + frame(b"a", first=0x00) * self.size(70000, 70000), 20.0)
            assert receive(client, 5.0)[1], "a message without end is accepted"
        for _ in range(self.size(200, 10)):
            with handshake(self.http, "/live") as client:
                client.sendall(frame(b"x" * 60000))
        return "; ".join(answers) + "; a message without an end: closed the connection"

    def bad_http(self):
        requests = {
            "garbage": b"\x16\x03\x01\x02\x00\x01" + self.chance.randbytes(500) + b"\r\n\r\n",
            "POST": b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 3\r\n\r\nabc",
            "huge header": b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"a" * 1000000 + b"\r\n\r\n",
            "100,000 headers": b"GET / HTTP/1.1\r\n" + b"X: a\r\n" * 100000 + b"\r\n",
            "huge target": b"GET /" + b"a" * 100000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n",
            "huge body": b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999\r\n\r\n" + b"a" * 100000,
            "negative body": b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: -1\r\n\r\n",
            "two lengths": b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
            "wrong chunks": b"GET / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffffff\r\n",
            "another host": b"GET /metrics HTTP/1.1\r\nHost: evil.example\r\n\r\n",
            "another origin": b"GET /metrics HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\n\r\n",
            "path": b"GET /../../etc/passwd HTTP/1.1\r\nHost: localhost\r\n\r\n",
        }
        answers = []
        for name, request in requests.items():
            answer = http(self.http, request, self.size(2.0, 0.3))
            status = answer.split(b"\r\n")[0].decode(errors="replace")
            assert not status.startswith("HTTP/1.1 200"), f"{name}: {status}"
            answers.append(f"{name}: {status[9:] or 'closed the connection'}")
        return "; ".join(answers)


ATTACKS = (
    "slow_http slow_lines endless_line long_lines deep_json wrong_utf8 nul_and_noise absurd_numbers many_ids flood_of_one "
    "flood_of_walkers flood_of_leaps flood_of_labels many_connections websockets bad_http"
).split()
