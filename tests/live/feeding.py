"""A recorder with a feed and a viewer's raw end of it, for tests that attack the feed."""

import socket
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from epa_rt.live.attach import Attached, Happened, Over, Rows, find
from epa_rt.logs.feed.place import sockets
from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.recorder import LogSummary, Recorder

LAYOUT = SampleLayout(
    inputs_bytes=4,
    outputs_bytes=4,
    measured=tuple(f"place{i}_pressure_pa" for i in range(30)),
    reference=(),
    command=(),
    estimate=(),
    states=("bring_up", "run"),
    phases=("one",),
)
NOTHING: dict[str, float] = {}


def recorder_at(path: Path, **options) -> Recorder:
    """An open recorder of a rig of thirty signals."""
    recorder = Recorder(path, LAYOUT, {"rig.yaml": b""}, {"run": {"period_s": "0.001"}}, **options)
    recorder.open()
    return recorder


def sample(recorder: Recorder, cycle: int) -> None:
    values = dict.fromkeys(LAYOUT.measured, float(cycle))
    images = (bytes(4), bytes(4))
    numbers = (cycle, cycle * 1_000_000, 1, 1, 0, 0, 0, 0, 0)
    recorder.sample(*numbers, *images, values, NOTHING, NOTHING, NOTHING)


def raw_viewer(log: Path) -> socket.socket:
    """A connection that reads nothing by itself."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    connection.connect(str(sockets(log)[0]))
    return connection


class Reader:
    """Reads a feed to its end: cycles and events in their order."""

    def __init__(self, log: Path):
        self.attached = Attached(find(log))
        self.cycles: list[int] = []
        self.events: list[Happened] = []
        self.over: Over | None = None

    def take(self, wait_s: float = 0.0) -> None:
        for message in self.attached.messages(wait_s):
            if isinstance(message, Rows):
                self.cycles += message.slots["cycle"].tolist()
            elif isinstance(message, Happened):
                self.events.append(message)
            elif isinstance(message, Over):
                self.over = message

    def take_all(self, recorder: Recorder) -> LogSummary:
        """What comes while the recorder closes the log, to the end; the log's summary."""
        with ThreadPoolExecutor(1) as pool:
            closing = pool.submit(recorder.close, "completed", "")
            self._take_all()
            return closing.result()

    def _take_all(self) -> None:
        while self.over is None:
            self.take(10.0)
        self.attached.close()
