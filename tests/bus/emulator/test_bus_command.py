"""`epa bus` on the command line, and the control channel behind it."""

import gc
import json
import socket
import subprocess
import sys
import textwrap

import pytest

from epa_rt.cli.bus import _FAULTS
from sim_backend.bus.bus_faults import ALL_FAULTS
from sim_backend.bus.control import ControlClient, ControlError, ControlServer
from sim_backend.bus.namespace import run_beside
from sim_backend.bus.server import Server
from tests.bus.emulator.bring_up import Wire
from tests.bus.emulator.conftest import RIGS


def test_help_names_every_kind_of_fault():
    assert [kind for kind in ALL_FAULTS if kind not in _FAULTS] == []


def test_every_kind_can_be_injected_and_cleared(make_bus):
    wire = Wire(make_bus("knee", lock_step=True))  # with two muscles, for what exchanges them
    places = {
        "slave": "analog_in",
        "slave with a mailbox": "drive",
        "slave with a clock": "coupler",
        "input row": "spam_pressure_pa",
        "valve row or port": "cmd_spam_inlet_open",
        "muscle": "spam",
        "": "",
    }
    before = wire.exchange(bytes(wire.output_size))
    for kind, about in ALL_FAULTS.items():
        wire.bus.faults.add(kind, places[about.where])
        wire.exchange(bytes(wire.output_size))
        wire.bus.faults.clear()
        assert wire.bus.faults.listed() == []
    assert len(before[0]) == wire.input_size


@pytest.mark.network
def test_status_truth_fault_and_stop_by_hand():
    script = textwrap.dedent("""
        import subprocess, sys
        def epa(*words):
            done = subprocess.run([sys.executable, "-m", "epa_rt", "bus", *words], capture_output=True, text=True)
            print(done.returncode, done.stdout.replace(chr(10), " "), done.stderr.strip(), sep="|")
        epa("status")
        epa("fault", "wire_broken", "--where", "muscle_pressure_pa", "--cycles", "100000")
        epa("fault", "slave_falls", "--where", "drive", "--value", "0x1A")
        epa("faults")
        epa("truth")
        epa("fault", "gremlins")
        epa("clear")
        epa("rewind")
        epa("stop")
    """)  # noqa: E501
    done = run_beside([sys.executable, "-c", script], RIGS / "bench.yaml")
    rows = [line.split("|") for line in done.stdout.splitlines()]
    assert [int(row[0]) for row in rows] == [0, 0, 0, 0, 0, 4, 0, 0, 0], done.stdout
    assert json.loads(rows[0][1])["slaves"]["drive"]["state"] == "INIT"
    assert [fault["kind"] for fault in json.loads(rows[3][1])["faults"]] == ["wire_broken"]
    assert json.loads(rows[4][1])["drive_enabled"] is False
    assert "gremlins" in rows[5][2] and "Traceback" not in rows[5][2]


def epa(*words):
    return subprocess.run(
        [sys.executable, "-m", "epa_rt", "bus", *words], capture_output=True, text=True
    )


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (["status", "--control", "/nonexistent/socket"], 4, "no emulated bus"),
        (
            ["serve", "--rig", str(RIGS / "bench.yaml"), "--interface", "nonexistent0"],
            4,
            "nonexistent0",
        ),
        (["run", "--rig", str(RIGS / "bench.yaml")], 2, "no command"),
    ],
)
def test_what_cannot_be_is_one_sentence(words, code, sentence):
    done = epa(*words)
    assert done.returncode == code and sentence in done.stderr and "Traceback" not in done.stderr


def test_the_control_channel_survives_nonsense(tmp_path):
    handlers = {}
    server = ControlServer(tmp_path / "control", handlers, lambda request: {"echo": request["do"]})
    try:
        client = ControlClient(tmp_path / "control")
        (accept,) = handlers.values()
        accept()
        (connection,) = [handler for handler in handlers.values() if handler is not accept]
        for line in (b"{\n", b"[]\n", b'{"x": 1}\n', b"\xff\xfe\n", b"null\n"):
            client._socket.sendall(line)
            connection()
            assert json.loads(client._file.readline())["ok"] is False
        client._socket.sendall(b'{"do": "x"}\n')
        connection()
        assert json.loads(client._file.readline()) == {"ok": True, "echo": "x"}
        client.close()
        connection()
        assert list(handlers.values()) == [accept]
    finally:
        server.close()
    with pytest.raises(ControlError, match="no emulated bus"):
        ControlClient(tmp_path / "control")


def test_the_control_channel_touches_no_file_that_is_not_its_own(tmp_path):
    path = tmp_path / "control"

    def serve():
        return ControlServer(path, {}, lambda request: {})

    for make, words in (
        (lambda: path.write_text("thesis"), "found a file"),
        (lambda: path.mkdir(), "found a file"),
        (lambda: path.symlink_to(tmp_path / "nowhere"), "found a file"),
    ):
        make()
        before = path.lstat()
        with pytest.raises(ControlError, match=words):
            serve()
        assert path.lstat().st_ino == before.st_ino
        path.rmdir() if path.is_dir() else path.unlink()

    server = serve()
    with pytest.raises(ControlError, match="found a socket in use"):
        serve()
    server._listener.close()  # as kill -9 does: the socket's name stays
    second = serve()
    server.close()  # no longer its own
    assert path.is_socket()
    path.unlink()
    path.write_text("somebody else's by now")
    second.close()
    assert path.read_text() == "somebody else's by now"


def test_before_it_says_ready_nothing_is_left_to_warm_up(bench):
    here, there = socket.socketpair()
    with here, there:
        server = Server(bench, here)
        server.stop()
        try:
            server.warm_up()
            assert not gc.isenabled() and gc.get_freeze_count() > 0
        finally:
            server.run()
        assert gc.isenabled() and gc.get_freeze_count() == 0
