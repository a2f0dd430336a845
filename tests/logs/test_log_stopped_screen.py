"""A screen that takes nothing more, by Ctrl-S or a reader that stopped, must not hold up the
recorder.
"""

import contextlib
import fcntl
import os
import pty
import select
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from epa_rt.logs.progress import ProgressLine, ProgressSpec

PRODUCER = """
import sys
sys.path.insert(0, sys.argv[1])
from log_samples import ATTACHMENTS, LAYOUT, METADATA, sample_of
from epa_rt.logs.progress import ProgressSpec
from epa_rt.logs.recorder import Recorder
recorder = Recorder(sys.argv[2], LAYOUT, ATTACHMENTS, METADATA, True, ProgressSpec(2000, 0.001), slots=256)
recorder.open()
for cycle in range(2000):
    recorder.sample(**sample_of(cycle))
summary = recorder.close("finished", "")
print(summary.samples, summary.lost_samples, summary.failure)
"""  # noqa: E501


@contextlib.contextmanager
def screen(kind: str) -> Iterator[tuple[int, int]]:
    """(reader's end, writer's end) of a terminal or a pipe that takes nothing."""
    reader, writer = os.pipe() if kind == "full pipe" else pty.openpty()
    try:
        if kind == "stopped terminal":
            termios.tcflow(writer, termios.TCOOFF)  # what Ctrl-S does
        else:
            _fill(reader, writer)
        yield reader, writer
    finally:
        if kind == "stopped terminal":
            termios.tcflow(writer, termios.TCOON)
        os.close(reader)
        os.close(writer)


LINE_BUFFER_BYTES = 4095  # what a terminal holds for its reader; the kernel fills it by and by


def _fill(reader: int, writer: int) -> None:
    """Write until nothing is taken and nothing is on its way that would make room again."""
    os.set_blocking(writer, False)
    while _written(writer) or _waiting(reader) < LINE_BUFFER_BYTES:
        time.sleep(0.01)
    os.set_blocking(writer, True)


def _written(writer: int) -> int:
    written = 0
    with contextlib.suppress(BlockingIOError):
        while True:
            written += os.write(writer, b"x" * 64)
    return written


def _waiting(reader: int) -> int:
    return struct.unpack("i", fcntl.ioctl(reader, termios.FIONREAD, bytes(4)))[0]


KINDS = pytest.mark.parametrize(
    "kind", ["stopped terminal", "terminal that nobody reads", "full pipe"]
)


@KINDS
@pytest.mark.timeout(300)
def test_the_log_is_whole_though_the_screen_takes_nothing(kind, tmp_path):
    command = [
        sys.executable,
        "-c",
        PRODUCER,
        str(Path(__file__).parent),
        str(tmp_path / "log.mcap"),
    ]
    with screen(kind) as (_, writer):
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=writer, text=True)
        assert done.stdout == "2000 0 None\n"
        assert not fcntl.fcntl(writer, fcntl.F_GETFL) & os.O_NONBLOCK, (
            "the shell's own terminal was changed"
        )


@KINDS
@pytest.mark.timeout(60)
def test_what_the_screen_did_not_take_is_left_out_and_the_next_line_comes(kind):
    with screen(kind) as (reader, writer), open(writer, "w", closefd=False) as stream:
        line = ProgressLine(ProgressSpec(4000, 0.001), ("running",), (), stream)
        line.update(0.0, 1000, 0, -1, 0.0)
        line.update(10.0, 2000, 0, -1, 0.0)
        if kind == "stopped terminal":
            termios.tcflow(writer, termios.TCOON)
        now_s, said = 20.0, b""
        while (
            b"00:03 of 00:04" not in said
        ):  # a terminal has room again some time after it was read
            line.update(now_s, 3000, 0, -1, 0.0)
            now_s += 10.0
            if select.select([reader], [], [], 0.1)[0]:
                said += os.read(reader, 65536)
        assert b"00:01 of" not in said and b"00:02 of" not in said
