"""Starting the recorder process, watching it and seeing it off."""

from __future__ import annotations

import json
import os
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

from epa_rt.logs.ring import CLOSING, STATUS, STATUS_STARTING, Ring

OPEN_TIMEOUT_S, CLOSE_TIMEOUT_S = 30.0, 60.0
EXIT_DISK = 3


class RecorderChild:
    """The recorder process of one log. The pipe to it stays open for as long as there is more to
    come.
    """

    def __init__(
        self, ring: Ring, job: dict[str, object], attachments: Mapping[str, bytes]
    ) -> None:
        """Start it. Raises OSError where no process can be started."""
        self._ring = ring
        job = job | {
            "ring_fd": ring.fd,
            "slots": ring.slots,
            "slot_bytes": ring.slot_bytes,
            "pid": os.getpid(),
            "attachments": [(name, len(data)) for name, data in attachments.items()],
        }
        asks_fd = job.get("asks_fd")
        # The child finds this package as the parent did, installed or not.
        path = os.pathsep.join(
            filter(None, [str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH")])
        )
        # A session of its own: Ctrl-C in the terminal is meant for the loop, which then closes the
        # log in good order.
        process = subprocess.Popen(
            [sys.executable, "-m", "epa_rt.logs.recorder_process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            bufsize=0,
            pass_fds=[ring.fd, asks_fd] if isinstance(asks_fd, int) else [ring.fd],
            start_new_session=True,
            env=os.environ | {"PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"},
        )
        assert process.stdin is not None  # it was asked for
        self._process, self._stdin = process, process.stdin
        ring.close_fd()
        encoded = json.dumps(job).encode()
        try:
            for part in (struct.pack("<Q", len(encoded)), encoded, *attachments.values()):
                self._send(part)
        except BrokenPipeError:
            pass  # it died already; `wait_until_open` says how

    @property
    def pid(self) -> int:
        return self._process.pid

    def wait_until_open(self) -> str | None:
        """Wait for the file to be open; gives what went wrong."""
        deadline_s = time.monotonic() + OPEN_TIMEOUT_S
        while self._ring.words[STATUS] == STATUS_STARTING and self.trouble() is None:
            if time.monotonic() > deadline_s:
                self._process.kill()
            time.sleep(0.002)
        return self.trouble()

    def trouble(self) -> str | None:
        """What the process says went wrong, or that it is no more."""
        code = self._process.poll()
        if self._ring.failure or not code:
            return self._ring.failure
        return f"recorder died ({f'signal {-code}' if code < 0 else f'exit code {code}'})"

    @property
    def died(self) -> bool:
        """Whether it ended by a signal, and so without a word."""
        code = self._process.poll()
        return code is not None and code < 0

    def finish(self) -> str | None:
        """Tell it that all has been said, and wait until it has written that; gives what went
        wrong.
        """
        self._ring.words[CLOSING] = 1
        self._stdin.close()
        try:
            self._process.wait(CLOSE_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.send_signal(signal.SIGKILL)
            self._process.wait()
            return f"recorder did not finish the log within {CLOSE_TIMEOUT_S:g} s"
        return self.trouble()

    def _send(self, data: bytes) -> None:
        view = memoryview(data)
        while view:
            view = view[self._stdin.write(view) :]
