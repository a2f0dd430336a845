"""Foxglove's server as a client of another make sees it, while a rig runs in real time."""

import json
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from epa_rt.logs.reader import LogReader
from tests.cli.shell import EXPERIMENTS, RIGS, ROOT, epa, start
from tests.live.foxglove_client import Client

PERIOD_NS = 1_000_000
PER_CYCLE = ("/cycle", "/measured", "/reference", "/command", "/estimate")
KNEE = ("run", EXPERIMENTS / "knee_chirp_short.yaml", "--rig", RIGS / "knee.yaml")


class Served:
    """`epa run --foxglove 0` under way: address and token as it printed them."""

    def __init__(self, out, speed):
        self.out = out
        self.process = start(*KNEE, "--speed", speed, "-o", out, "--quiet", "--foxglove", 0)
        self.said = ""
        while "token" not in self.said:
            line = self.process.stderr.readline()
            assert line, f"the run ended early: {self.process.communicate()}"
            self.said += line
        self.url, self.token = re.search(r"(ws://\S+), token .*: (\S+)$", self.said, re.M).groups()

    def log(self) -> LogReader:
        (path,) = self.out.glob("*.mcap")
        return LogReader(path)

    def end(self) -> tuple[int, str]:
        out, err = self.process.communicate(timeout=300)
        return self.process.returncode, out + err


@pytest.fixture
def served(tmp_path, request):
    """At the speed of the test's mark, 1 where it has none."""
    mark = request.node.get_closest_marker("parametrize")
    found = Served(tmp_path, request.param if mark else 1)
    yield found
    if found.process.poll() is None:
        found.process.kill()
        found.process.communicate()


def test_a_client_of_another_make_gets_every_signal_of_every_cycle_and_stops_by_token(served):
    client = Client(served.url)
    client.take_until(lambda: client.channels)
    topics = [*PER_CYCLE, "/event", "/state", "/about", "/joint_states"]
    assert {*topics} <= client.channels.keys()  # at once, however early the client came
    assert client.info["name"] == "epa"
    client.subscribe(*topics)
    client.take_until(lambda: client.payloads["/about"] and len(client.stamps["/command"]) > 2500)

    about = json.loads(client.payloads["/about"][0])
    for topic in PER_CYCLE:  # the stated rate, by the stamps of the rig: no cycle is missing
        assert about["rates_hz"][topic] == pytest.approx(1e9 / PERIOD_NS)
        assert set(np.diff(client.stamps[topic])) == {PERIOD_NS}, topic
    assert about["rates_hz"]["/joint_states"] == pytest.approx(100.0)
    assert set(np.diff(client.stamps["/joint_states"])) == {10 * PERIOD_NS}
    assert client.channels["/joint_states"]["schemaName"] == "foxglove.JointStates"
    assert about["units"]["knee_angle_rad"] == "rad" and about["units"]["spam_pressure_pa"] == "Pa"

    for given in (b"[]", b"no JSON", b'{"token": ""}', b'{"token": 7}'):
        assert "expected" in client.call("stop", given)["failure"]
    state = json.loads(client.payloads["/state"][-1])
    assert state["state"] not in ("stop", "brake", "safe", "done"), "no token, and it stopped"

    marked = json.dumps({"token": served.token, "text": "seen"}).encode()
    assert client.call("mark", marked) == {"json": {"done": "mark"}}
    right = json.dumps({"token": served.token}).encode()
    assert client.call("stop", right) == {"json": {"done": "stop"}}
    code, said = served.end()
    assert code == 130 and "stopped: the operator asked to stop" in said

    with served.log() as log:
        kinds = {event.kind: event for event in log.events()}
        assert kinds["mark"].text == "seen" and kinds["mark"].data == {"who": "Foxglove"}
        assert kinds["request"].text == "stop, asked by Foxglove"
        for topic in PER_CYCLE[1:]:  # each value that was received stands in the log
            _same_values(client, topic, log)


def _same_values(client: Client, topic: str, log: LogReader) -> None:
    decode = client.decoder(topic).FromString
    names = log.layout.groups()[topic[1:]]
    t_ns = log.columns("/cycle", ["t_ns"])["t_ns"]
    first = int(np.searchsorted(t_ns, client.stamps[topic][0]))
    logged = log.columns(topic)
    for name in names:
        got = [getattr(decode(data), name) for data in client.payloads[topic][:500]]
        assert np.array_equal(got, logged[name][first : first + len(got)], equal_nan=True), name


@pytest.mark.parametrize("served", [4], indirect=True)
def test_clients_that_hang_die_or_flood_leave_the_run_alone_and_it_is_on_loopback_only(served):
    port = int(served.url.rsplit(":", 1)[1])
    words = [sys.executable, "-m", "tests.live.foxglove_client", served.url]
    hanging, dying = (
        subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        for _ in range(2)
    )
    for process, number in ((hanging, signal.SIGSTOP), (dying, signal.SIGKILL)):
        assert process.stdout.readline() == b"reading\n"
        process.send_signal(number)
    raw = socket.create_connection(("127.0.0.1", port))
    raw.sendall(b"GET / HTTP/1.1\r\n" + b"x" * 100_000)
    flooding = Client(served.url)
    for _ in range(300):
        flooding.socket.send(json.dumps({"op": "subscribe", "subscriptions": "no list"}))
        flooding.socket.send(bytes([2]) + b"\xff" * 40)
    assert _listening_on(port) == ["0100007F"]  # 127.0.0.1, as the kernel writes it
    flooding.close()
    code, said = served.end()
    hanging.kill()
    for process in (hanging, dying):
        process.communicate()
    raw.close()
    assert code == 0 and said.startswith("completed"), said
    assert "Invalid" not in said  # nothing of a client's on the operator's screen
    with served.log() as log:
        assert log.ending is not None and not log.ending.lost_samples and not log.missing


def _listening_on(port: int) -> list[str]:
    """The addresses on which this machine listens at a port, of both families, in hexadecimal."""
    found = []
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        for line in Path(table).read_text().splitlines()[1:]:
            address, state = line.split()[1], line.split()[3]
            if state == "0A" and int(address.rsplit(":", 1)[1], 16) == port:
                found.append(address.rsplit(":", 1)[0])
    return found


def test_a_port_that_is_taken_is_said_before_anything_moves(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        done = epa(*KNEE, "-o", tmp_path / "out", "--foxglove", port)
    assert done.returncode == 2 and f"cannot listen on 127.0.0.1:{port}" in done.stderr
    assert not (tmp_path / "out").exists()
