"""What a live view costs the loop: lateness with and without both viewers, in one run. Prints JSON.

The knee chirp runs on the simulated rig in real time with its recorder. In alternating stretches of
the same run the terminal view and a Foxglove client that takes everything are attached, and are
not. `ratio_p99_9` compares the 99.9th percentiles of all watched and of all unwatched cycles;
`ratio_of_neighbours` is the median ratio of neighbouring stretches, which a machine that grows
busier does not shift. The first and the last second of a stretch are left out.

`silent` names the watched stretches in which the client had nothing of a topic with a stated rate;
`stretches` are those that were wanted and those that the run lasted for. The exit code is 1 where
any is silent or missing.

With --attack a hung viewer and one that floods are attached as well, in the watched stretches.
`feed_us_per_batch` is what the feed adds to the recorder for a batch of rows while nobody looks.

    python scripts/bench_live.py --pairs 10 --stretch 10
"""

import argparse
import contextlib
import json
import os
import pty
import select
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from epa_rt.live.attach import Attached, Rows, find
from epa_rt.logs.feed.feed import Feed
from epa_rt.logs.feed.place import sockets
from epa_rt.logs.layout import FLAG_OVERRUN, SampleLayout
from epa_rt.logs.reader import LogReader
from epa_rt.logs.ring import slot_dtype

SKIPPED_S = 1.0
READS_S = 30.0  # for a client to have its first message, on a machine that is busy
_ENV = os.environ | {"PYTHONPATH": str(ROOT), "TERM": "xterm-256color"}

READER = """
import json, os, signal, struct, sys, time
from websockets.sync.client import connect
topics, seen, stated = {}, {}, {}
def end(*_):
    print(json.dumps({"stated_hz": stated, "seen": seen}), flush=True)
    os._exit(0)  # a farewell would wait for the messages that are on their way
signal.signal(signal.SIGTERM, end)
def connected(url):
    while True:  # the server listens once the run's channels are there
        try:
            return connect(url, subprotocols=["foxglove.sdk.v1"], max_size=None)
        except ConnectionRefusedError:
            time.sleep(0.01)
with connected(sys.argv[1]) as socket:
    while True:
        message = socket.recv()
        if isinstance(message, str):
            said = json.loads(message)
            if said["op"] == "advertise":
                topics |= {c["id"]: c["topic"] for c in said["channels"]}
                asked = [{"id": c["id"], "channelId": c["id"]} for c in said["channels"]]
                socket.send(json.dumps({"op": "subscribe", "subscriptions": asked}))
        elif message[0] == 1:
            number, t_ns = struct.unpack_from("<IQ", message, 1)
            topic = topics[number]
            if topic == "/about":
                stated = json.loads(message[13:])["rates_hz"]
            if not seen:
                print("reads", flush=True)
            count, first_ns, _ = seen.get(topic, (0, t_ns, t_ns))
            seen[topic] = (count + 1, first_ns, t_ns)
"""


class Stretches:
    """Attaches and detaches the viewers while the run is on; when each stretch began and ended, by
    the run's clock, and whether it was watched.
    """

    def __init__(self, log: Path, pairs: int, stretch_s: float, attack: bool):
        self._log, self._stretch_s, self._attack = log, stretch_s, attack
        self.wanted = 2 * pairs
        self.found: list[tuple[bool, float, float]] = []
        self.received: list[dict[str, Any]] = []  # what the Foxglove client had, watched by watched

    def run(self) -> None:
        offset_s = _run_clock(self._log)
        for number in range(self.wanted):
            if not sockets(self._log):
                return  # the run is over
            watched = number % 2 == 1
            own = viewers(self._log, self._attack, self.received)
            with own if watched else contextlib.nullcontext():
                at_s = time.monotonic()
                time.sleep(self._stretch_s)
                self.found.append((watched, at_s + offset_s, time.monotonic() + offset_s))


def _run_clock(log: Path) -> float:
    """What to add to this process's clock for the run's, in s."""
    with Attached(find(log)) as attached:
        while True:
            for message in attached.messages(1.0):
                if isinstance(message, Rows):
                    return float(message.slots["t_ns"][-1]) / 1e9 - time.monotonic()


@contextlib.contextmanager
def viewers(log: Path, attack: bool, received: list[dict[str, Any]]) -> Iterator[None]:
    """A terminal view on a terminal of its own, and Foxglove's server with a client; what that
    client had is added to ``received``, nothing where it said nothing.
    """
    screen, terminal = pty.openpty()
    command = [sys.executable, "-m", "epa_rt", "live", str(log)]
    view = subprocess.Popen(
        command, cwd=ROOT, env=_ENV, stdin=terminal, stdout=terminal, stderr=terminal
    )
    threading.Thread(target=_read_away, args=(screen,), daemon=True).start()
    server = subprocess.Popen(
        [*command, "--foxglove", "0"], cwd=ROOT, env=_ENV, stderr=subprocess.PIPE, text=True
    )
    assert server.stderr is not None
    words = server.stderr.readline().split()  # "Foxglove: ws://...", or what is wrong
    client = subprocess.Popen(
        [sys.executable, "-c", READER, words[1].rstrip(",")],
        env=_ENV,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    assert client.stdout is not None
    select.select([client.stdout], [], [], READS_S)
    hostile = list(_attackers(log)) if attack else []
    try:
        yield
    finally:
        for one in hostile:
            one.close()
        client.terminate()
        had: dict[str, Any] = {"stated_hz": {}, "seen": {}}
        with contextlib.suppress(subprocess.TimeoutExpired, json.JSONDecodeError, IndexError):
            had = json.loads(client.communicate(timeout=10.0)[0].splitlines()[-1])
        received.append(had)
        server.send_signal(signal.SIGINT)
        for process in (client, view):
            process.kill()
        for process in (client, view, server):
            process.wait()
        os.close(terminal)


def _attackers(log: Path) -> Iterator[socket.socket]:
    """One viewer that reads nothing, and one that sends all that is taken."""
    for floods in (False, True):
        connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        connection.connect(str(sockets(log)[0]))
        if floods:
            connection.settimeout(0.2)
            with contextlib.suppress(OSError):
                connection.sendall(b'{"ask": "mark"}\n' * 200_000)
        yield connection


def _read_away(screen: int) -> None:
    with contextlib.suppress(OSError):
        while os.read(screen, 65536):
            pass


def feed_us_per_batch(batches: int = 20_000, rows: int = 5) -> float:
    """Median cost in us of a batch of rows and a tick of the feed, with nobody connected."""
    layout = SampleLayout(32, 16, tuple(f"a{i}_m" for i in range(30)), (), (), (), ("a",), ("b",))
    slots = np.zeros(rows, slot_dtype(layout))
    with tempfile.NamedTemporaryFile() as file:
        feed = Feed(file.name, {})
        feed.open()
        taken_ns = np.empty(batches, np.int64)
        for i in range(batches):
            begin_ns = time.perf_counter_ns()
            feed.rows(slots)
            feed.tick(dict)
            feed.readers, feed.writers  # noqa: B018 - what a look at the sockets asks for
            taken_ns[i] = time.perf_counter_ns() - begin_ns
        feed.close()
    return round(float(np.median(taken_ns)) / 1e3, 2)


def measure(pairs: int, stretch_s: float, attack: bool) -> dict[str, Any]:
    """One run, its stretches, and what its log says of them."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "run.mcap"
        run = subprocess.Popen(
            [
                *(sys.executable, "-m", "epa_rt", "run"),
                str(ROOT / "config/experiments/knee_chirp.yaml"),
                *("--rig", str(ROOT / "config/rigs/knee.yaml"), "--speed", "1", "--quiet"),
                *("-o", str(log)),
            ],
            cwd=ROOT,
            env=_ENV,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        while run.poll() is None and not (log.exists() and log.stat().st_size > 30_000):
            time.sleep(0.05)
        stretches = Stretches(log, pairs, stretch_s, attack)
        stretches.run()
        run.send_signal(signal.SIGINT)
        out, err = run.communicate()
        with LogReader(log) as found:
            columns = found.columns("/cycle", ["t_ns", "lateness_ns", "flags"])
            refused = [event for event in found.events() if event.kind == "mark"]
            missing = found.missing
    return report(stretches, columns, missing, len(refused), out + err)


def report(
    stretches: Stretches, columns: dict[str, np.ndarray], missing: list[str], marks: int, said: str
) -> dict[str, Any]:
    """Percentiles of each stretch, and the ratio of watched to unwatched."""
    t_s = columns["t_ns"] / 1e9
    late_us = columns["lateness_ns"] / 1e3
    p999: dict[bool, list[float]] = {False: [], True: []}
    pooled: dict[bool, list[np.ndarray]] = {False: [], True: []}
    without_cycles = 0
    for watched, begin_s, end_s in stretches.found:
        inside = (t_s > begin_s + SKIPPED_S) & (t_s < end_s - SKIPPED_S)
        if inside.any():
            p999[watched].append(float(np.percentile(late_us[inside], 99.9)))
            pooled[watched].append(late_us[inside])
        else:
            without_cycles += 1
    alone, beside = (np.concatenate(pooled[kind] or [late_us]) for kind in (False, True))
    ratios = [a / b for a, b in zip(p999[True], p999[False], strict=False) if b > 0.0]
    return {
        "cycles": len(t_s),
        "late_cycles": int(np.count_nonzero(columns["flags"] & FLAG_OVERRUN)),
        "p99_9_us_alone": [round(value, 1) for value in p999[False]],
        "p99_9_us_watched": [round(value, 1) for value in p999[True]],
        "median_us_alone": round(float(np.median(alone)), 1),
        "median_us_watched": round(float(np.median(beside)), 1),
        "ratio_p99_9": round(float(np.percentile(beside, 99.9) / np.percentile(alone, 99.9)), 3),
        "ratio_of_neighbours": round(statistics.median(ratios), 3) if ratios else None,
        "ratios_of_neighbours": [round(ratio, 3) for ratio in ratios],
        "foxglove": rates(stretches.received),
        "stretches": [stretches.wanted, len(stretches.found) - without_cycles],
        "silent": silent(stretches.received),
        "missing_from_the_log": missing,
        "marks_of_a_flood": marks,
        "said": said.strip().splitlines()[0] if said.strip() else "",
    }


def rates(received: list[dict[str, Any]]) -> dict[str, dict[str, object]]:
    """Of each topic: the stated rate, what came of it in each watched stretch by the log's stamps,
    None where nothing did.
    """
    stated = {topic: hz for one in received for topic, hz in one["stated_hz"].items()}
    found: dict[str, dict[str, object]] = {}
    for topic in sorted(stated):  # without /about and events: they come when there is a cause
        own = [one["seen"].get(topic, (0, 0, 0)) for one in received]
        hertz = [1e9 * (n - 1) / (last - first) if last > first else None for n, first, last in own]
        found[topic] = {
            "stated_hz": stated[topic],
            "received_hz": [value and round(value, 2) for value in hertz],
            "messages": sum(count for count, *_ in own),
        }
    return found


def silent(received: list[dict[str, Any]]) -> list[str]:
    """Of each watched stretch: which topics with a stated rate a client that asked for all of them
    had nothing of.
    """
    stated = {topic for one in received for topic in one["stated_hz"]}
    found = []
    for number, one in enumerate(received):
        missing = sorted(stated - one["seen"].keys())
        if missing or not one["seen"]:
            had = ", ".join(missing) if one["seen"] else "message at all"
            found.append(f"watched stretch {number}: no {had}")
    return found


def main() -> int:
    arguments = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    arguments.add_argument("--pairs", type=int, default=5, help="watched and unwatched stretches")
    arguments.add_argument("--stretch", type=float, default=10.0, metavar="S", help="of each, in s")
    arguments.add_argument("--attack", action="store_true", help="also viewers that hang and flood")
    chosen = arguments.parse_args()
    found = measure(chosen.pairs, chosen.stretch, chosen.attack)
    print(
        json.dumps(
            {
                "processors": os.cpu_count(),
                "load": os.getloadavg()[0],
                "feed_us_per_batch": feed_us_per_batch(),
                **found,
                "bar": {"ratio_p99_9": 1.1, "silent": []},
            },
            indent=2,
        )
    )
    wanted, done = found["stretches"]
    return 1 if found["silent"] or done < wanted else 0


if __name__ == "__main__":
    raise SystemExit(main())
