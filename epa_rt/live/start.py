"""Starts the viewers of a run as processes of their own, and sees them off after its end."""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import select
import signal
import subprocess
import sys
import termios
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from epa_rt.realtime.screen import Notice

READY_S = 30.0  # for a view to be there: loading one takes some seconds on a busy machine
GOES_S = 3.0  # for a viewer to go by itself after the run's end, beyond what it shows
DEFAULT_PORT = 8765
_LEAVE_SCREEN = "\x1b[<u\x1b[?1049l\x1b[?7h\x1b[?25h\x1b[?2004l\x1b[?1004l\x1b[0m"
"""Leaves the second screen, wraps lines and shows the cursor: for a view that was killed."""


class NoView(Exception):
    """A view that was asked for cannot be had; one sentence."""


@dataclass(frozen=True)
class Wanted:
    """Which views. ``port`` of Foxglove's server, None for none; ``rate_hz`` at most."""

    terminal: bool = False
    port: int | None = None
    host: str = "127.0.0.1"
    rate_hz: float | None = None


class Views:
    """The views of one run: `open` before its log is there, `begin` once it is, `finish` after.

    Raises NoView, before anything moves, where one cannot be had.
    """

    def __init__(self, wanted: Wanted) -> None:
        self.wanted = wanted
        self.words: list[str] = []  # for the operator
        self._foxglove: subprocess.Popen[bytes] | None = None
        self._terminal: subprocess.Popen[bytes] | None = None
        self._settings: list[Any] | None = None

    @property
    def has_terminal(self) -> bool:
        """Whether a view has the terminal now."""
        return self._terminal is not None and self._terminal.poll() is None

    def open(self, loop_core: int | None) -> None:
        """Look for a terminal, and let Foxglove's server listen."""
        if self.wanted.terminal and not all(s.isatty() for s in (sys.stdin, sys.stderr)):
            raise NoView("--live: found no terminal, expected one (--foxglove needs none)")
        if self.wanted.port is not None:
            self._open_foxglove(self.wanted.port, loop_core)

    def begin(self, log: Path) -> None:
        """The run's log is open: show it."""
        if self._foxglove is not None:
            assert self._foxglove.stdin is not None
            with contextlib.suppress(OSError):  # it went away; the run does not need it
                self._foxglove.stdin.write(json.dumps(str(log.absolute())).encode() + b"\n")
                self._foxglove.stdin.flush()
        if self.wanted.terminal:
            with contextlib.suppress(termios.error):
                self._settings = termios.tcgetattr(sys.stdin.fileno())
            self._begin_terminal(log)

    def notice(self) -> Notice:
        """Sentences for the operator: not over a view that has the screen, which shows them."""
        return _NoticeBeside(self)

    def served(self) -> int:
        """Wait until Foxglove's server ends, with its run, or Ctrl-C; the exit code of it."""
        assert self._foxglove is not None
        try:
            return self._foxglove.wait()
        except KeyboardInterrupt:
            self._foxglove.terminate()
            return 0

    def finish(self) -> None:
        """Wait for the views to go, then make them; the terminal is as it was. Ctrl-C shortens the
        wait. A later one does nothing: how the run ended is still to be said.
        """
        if self._terminal is not None:
            self._wait_for_screen(self._terminal)
        with _without_interrupts():
            self._see_all_off()

    def _see_all_off(self) -> None:
        if self._terminal is not None:
            if self._terminal.poll() is None:
                _see_off(self._terminal, 0.5)
            self._give_back_terminal(self._terminal)
            self._terminal = None
        if self._foxglove is not None:
            assert self._foxglove.stdin is not None and self._foxglove.stdout is not None
            with contextlib.suppress(OSError):
                self._foxglove.stdin.close()
            _see_off(self._foxglove, GOES_S)
            self._foxglove.stdout.close()
            self._foxglove = None

    def __enter__(self) -> Views:
        return self

    def __exit__(self, *_: object) -> None:
        self.finish()

    def _begin_terminal(self, log: Path) -> None:
        """Start the terminal view, and wait until it is to be seen: the operator watches from the
        first motion on.
        """
        from epa_rt.live.terminal_process import WORDS

        seen, shown = os.pipe()
        try:
            words = ("terminal_process", str(log.absolute()), str(shown))
            told = {WORDS: self.words[0]} if self.words else {}
            self._terminal = self._process(*words, pass_fds=(shown,), told=told)
        finally:
            os.close(shown)
        select.select([seen], [], [], READY_S)
        os.close(seen)

    def _wait_for_screen(self, process: subprocess.Popen[bytes]) -> None:
        from epa_rt.live.terminal_process import STAYS_S

        with contextlib.suppress(subprocess.TimeoutExpired, KeyboardInterrupt):
            process.wait(STAYS_S + GOES_S)

    def _give_back_terminal(self, process: subprocess.Popen[bytes]) -> None:
        if process.returncode != 0:
            with contextlib.suppress(OSError, ValueError):
                sys.stderr.write(_LEAVE_SCREEN)
                sys.stderr.flush()
        if self._settings is not None:
            with contextlib.suppress(termios.error, OSError):
                termios.tcsetattr(sys.stdin.fileno(), termios.TCSADRAIN, self._settings)

    def _open_foxglove(self, port: int, loop_core: int | None) -> None:
        token = secrets.token_urlsafe(16)
        spec = {"host": self.wanted.host, "port": port, "token": token}
        spec |= {"rate_hz": self.wanted.rate_hz, "core": loop_core}
        process = self._process("foxglove_process", piped=True)
        self._foxglove = process
        assert process.stdin is not None and process.stdout is not None
        with contextlib.suppress(OSError):
            process.stdin.write(json.dumps(spec).encode() + b"\n")
            process.stdin.flush()
        answer = process.stdout.readline() if _has_answer(process) else b""
        found = json.loads(answer) if answer else {"error": "its process does not answer"}
        if "error" in found:
            self.finish()
            raise NoView(
                f"--foxglove: cannot listen on {self.wanted.host}:{port}: {found['error']}"
            )
        where = f"ws://{_written(self.wanted.host)}:{found['port']}"
        self.words.append(f"Foxglove: {where}, token for its services stop and mark: {token}")

    def _process(
        self,
        name: str,
        *arguments: str,
        piped: bool = False,
        pass_fds: tuple[int, ...] = (),
        told: dict[str, str] | None = None,
    ) -> subprocess.Popen[bytes]:
        """``told``: what goes by the environment, which no other user sees."""
        root = str(Path(__file__).parents[2])
        path = os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")]))
        words = [sys.executable, "-m", f"epa_rt.live.{name}", *arguments]
        environment = os.environ | {"PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"} | (told or {})
        if piped:
            # A session of its own: Ctrl-C in the terminal is meant for the loop.
            return subprocess.Popen(
                words,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                start_new_session=True,
                env=environment,
            )
        with _interrupts_held_back():  # the view takes this over: Ctrl-C is meant for the loop
            return subprocess.Popen(words, env=environment, pass_fds=pass_fds)


class _NoticeBeside(Notice):
    """A notice that is left out while a view has the screen."""

    def __init__(self, views: Views) -> None:
        super().__init__()
        self._views = views

    def say(self, sentence: str) -> None:
        if not self._views.has_terminal:
            super().say(sentence)


@contextlib.contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """A Ctrl-C meanwhile comes afterwards; a process that begins here never hears one."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _without_interrupts() -> Iterator[None]:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _has_answer(process: subprocess.Popen[bytes]) -> bool:
    assert process.stdout is not None  # it was asked for
    return bool(select.select([process.stdout], [], [], READY_S)[0])


def _see_off(process: subprocess.Popen[bytes], wait_s: float) -> None:
    """End a process: wait, ask, kill."""
    for number in (0, signal.SIGTERM, signal.SIGKILL):  # 0: only looks whether it is there
        process.send_signal(number)
        try:
            process.wait(wait_s)
            return
        except subprocess.TimeoutExpired:
            wait_s = 0.5


def _written(host: str) -> str:
    """A host as it stands in a URL."""
    return f"[{host}]" if ":" in host else host
