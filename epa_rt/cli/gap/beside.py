"""Work in processes beside this one, which end without a word with it or by Ctrl-C."""

import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process
from types import FrameType
from typing import TypeVar

from epa_rt.cli.exits import FAILED, STOPPED, VerbError

Answer = TypeVar("Answer")


class Beside:
    """Processes that are started anew, as they are asked for; threads may ask at once."""

    def __init__(self, processes: int):
        self._pool = ProcessPoolExecutor(processes, get_context("spawn"), _begin)

    def ask(self, work: Callable[..., Answer], *arguments: object) -> Answer:
        """What ``work`` gives, done by one of them. Raises what it raises, and VerbError where one
        was ended by something else.
        """
        try:
            return self._begun(work, *arguments).result()
        except BrokenProcessPool:
            raise VerbError(
                "found a process beside this one that was ended (out of memory?), expected its"
                " answer",
                FAILED,
            ) from None

    def _begun(self, work: Callable[..., Answer], *arguments: object) -> "Future[Answer]":
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:  # a process takes this over: Ctrl-C while it loads waits for its handler
            return self._pool.submit(work, *arguments)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def close(self) -> None:
        """Waits for what is under way; nothing else begins."""
        self._pool.shutdown(cancel_futures=True)


def _begin() -> None:
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is to be ignored
        signal.signal(signal.SIGINT, _end)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    end_with_parent()


def end_with_parent() -> None:
    """From now on this process ends, without a word, when the one that started it does."""
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _end(_number: int, _frame: FrameType | None) -> None:
    os._exit(STOPPED)


def _wait_for_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(STOPPED)
