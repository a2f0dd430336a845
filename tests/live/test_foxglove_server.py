"""Foxglove's server in this process: who comes early, and who guesses the token."""

import socket
import threading

import pytest

from epa_rt.cli.inputs import load_inputs
from epa_rt.live import foxglove_server
from epa_rt.live.attach import Attached, find
from epa_rt.live.foxglove_channels import RunChannels
from epa_rt.live.foxglove_server import Refused, RunServer, ServerSpec
from epa_rt.live.reserved_port import ReservedPort
from epa_rt.logs.recorder import Recorder
from epa_rt.logs.schema import cycle_topics
from epa_rt.loop.assembly import assemble
from tests.cli.shell import EXPERIMENTS, RIGS
from tests.live.foxglove_client import Client

HOST = "127.0.0.1"
CYCLES = 50


@pytest.fixture
def recorder(tmp_path, monkeypatch):
    """A recorder of the knee whose cycles a test gives; its socket's folder has a short path."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    experiment, rig = EXPERIMENTS / "knee_chirp_short.yaml", RIGS / "knee.yaml"
    inputs = load_inputs(experiment, rig, None, with_plant=False)
    layout = assemble(inputs.rig, inputs.experiment).layout
    own = Recorder(
        tmp_path / "run.mcap",
        layout,
        {"rig.yaml": rig.read_bytes()},
        {"run": {"period_s": "0.001"}},
        lossless=True,
    )
    own.open()
    yield own
    own.close("completed", "")


@pytest.fixture
def attached(recorder, tmp_path):
    with Attached(find(tmp_path / "run.mcap")) as found:
        yield found


def _give(recorder: Recorder, layout, cycle: int) -> None:
    groups = [dict.fromkeys(names, float(cycle)) for names in _groups(layout)]
    images = bytes(layout.inputs_bytes), bytes(layout.outputs_bytes)
    recorder.sample(cycle, cycle * 1_000_000, 1, 1, 0, 0, 0, 0, 0, *images, *groups)


def _groups(layout) -> tuple[tuple[str, ...], ...]:
    return layout.measured, layout.reference, layout.command, layout.estimate


def test_who_comes_first_gets_every_channel_for_none_is_made_while_it_is_connected(
    recorder, attached, monkeypatch
):
    """foxglove-sdk 0.30 loses a subscription that answers a new channel's advertisement at once."""
    with ReservedPort(HOST, 0) as reserved:
        refusals = []

        class Early(RunChannels):
            def __init__(self, *given) -> None:
                for _ in range(2):  # before the first channel, and after the last
                    with pytest.raises(ConnectionRefusedError):
                        socket.create_connection((HOST, reserved.port))
                    if not refusals:
                        super().__init__(*given)
                    refusals.append(reserved.port)

        monkeypatch.setattr(foxglove_server, "RunChannels", Early)
        server = RunServer(ServerSpec(HOST, reserved.port), attached)
        assert refusals == [reserved.port] * 2 and server.port == reserved.port
    client = Client(f"ws://{HOST}:{server.port}")
    client.take_until(lambda: client.channels)
    topics = {topic.name for topic in cycle_topics(attached.facts.layout)}
    assert {*topics, "/state", "/about", "/event", "/joint_states"} == client.channels.keys()
    client.subscribe(*topics, "/state")
    following = threading.Thread(target=server.follow)
    following.start()
    # The server takes subscriptions in their order: with the answer of the last all others are in.
    client.take_until(lambda: client.payloads["/state"])
    for cycle in range(CYCLES):
        _give(recorder, attached.facts.layout, cycle)
    client.take_until(lambda: all(len(client.stamps[topic]) == CYCLES for topic in topics))
    client.close()
    recorder.close("completed", "")
    following.join()
    server.close()


def test_a_port_that_is_reserved_is_nobody_elses_and_free_again_after():
    with ReservedPort(HOST, 0) as reserved:
        other = socket.socket()
        with other, pytest.raises(OSError, match="in use"):
            other.bind((HOST, reserved.port))
    taken = socket.create_server((HOST, reserved.port))
    with taken, pytest.raises(OSError, match="in use"):
        ReservedPort(HOST, reserved.port)


def test_a_flood_of_wrong_tokens_keeps_one_thread_at_most_from_who_has_the_token(
    monkeypatch, attached
):
    go_on, waiting = threading.Event(), threading.Semaphore(0)

    def sleep(_seconds: float) -> None:
        waiting.release()
        go_on.wait(60)

    monkeypatch.setattr(foxglove_server.time, "sleep", sleep)
    server = RunServer(ServerSpec(port=0, token="right"), attached)

    def guess() -> None:
        with pytest.raises(Refused):
            server._check_token({"token": "wrong"})

    guesses = [threading.Thread(target=guess) for _ in range(20)]
    for one in guesses:
        one.start()
    assert waiting.acquire(timeout=60)
    for one in guesses:
        one.join(0.2)
    held = [one for one in guesses if one.is_alive()]
    server._check_token({"token": "right"})
    go_on.set()
    for one in held:
        one.join()
    server.close()
    assert len(held) == 1 and server.refused == 20
