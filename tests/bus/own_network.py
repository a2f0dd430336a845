"""Functions of the tests in a network of their own: ``call("tests.bus.driver.cases:opens",
rig="bench")``.

`unshare` starts one hall per test process. It loads what is heavy once and forks for every call, so
that a call costs some milliseconds and meets nothing that another has left. Its watchmen, one
pinned to each core, measure how long this machine let no ordinary process run; a test on a bus that
fails beside such a stall is ``repeated``, and told of at the end.
"""

import atexit
import functools
import gc
import importlib
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sim_backend.bus.namespace import AS_USER, die_with_parent, refused
from tests.bus.watchmen import Watchmen

ROOT = Path(__file__).resolve().parents[2]
# longer than any ordinary process waits for its turn on two busy cores: what runs by the clock
# cannot bear it
STALL_S = 0.05
LOCK_STEP_STALL_S = 0.15  # bring-up waits so long for an answer
TRIES = 3
_LONGEST_S = 240.0  # a bound for what hangs, not a figure
STALLS: list[str] = []  # what was repeated, for the summary
REAL_TIME = pytest.mark.xdist_group(
    "real time"
)  # one after the other: two at once would be each other's noise


class CallFailed(AssertionError):
    """The function raised, or hung; with what it printed."""


@functools.cache
def why_not() -> str | None:
    """Why no network of one's own can be had here; None where it can."""
    return refused(AS_USER)


def call(where: str, **arguments: object) -> object:
    """Runs ``module:function(**arguments)`` in the hall; all of it JSON. Raises CallFailed."""
    answer = _hall().ask({"where": where, "arguments": arguments})
    if not answer["ok"]:
        raise CallFailed(f"{where} {arguments}: {answer['error']}\n{answer['said'][-6000:]}")
    return answer["result"]


def repeated(what: str, run: Callable[[], Any], longest_stall_s: float) -> Any:
    """``run()``, and again, twice at most, where it raised while the watchmen saw this machine
    stand still for longer than ``longest_stall_s``: what the machine did not do must not be read as
    what the driver does. Nothing else repeats it.
    """
    hall = _hall()
    for tried in range(1, TRIES + 1):
        began_s = time.monotonic()
        try:
            return run()
        except Exception as error:
            stall_s = hall.ask({"since_s": began_s})["stall_s"]
            if tried == TRIES or stall_s < longest_stall_s:
                raise
            first = (str(error).strip().splitlines() or [type(error).__name__])[0][:160]
            STALLS.append(
                f"{what}: run {tried} failed ({first}) while this machine stood still for"
                f" {stall_s:.2f} s; run again"
            )
    return None


class Hall:
    """The process in the network, as seen from outside. ``ask`` is for one caller at a time."""

    def __init__(self):
        self._process = subprocess.Popen(
            [*AS_USER, sys.executable, "-W", "error", "-m", "tests.bus.own_network"],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
        self._number = 0
        atexit.register(self.close)

    def ask(self, request: dict) -> dict:
        self._number += 1
        self._process.stdin.write(json.dumps({**request, "number": self._number}) + "\n")
        self._process.stdin.flush()
        for line in self._process.stdout:
            answer = json.loads(line)
            if (
                answer["number"] == self._number
            ):  # an older one belongs to a test that ran out of its time
                return answer
        raise CallFailed(f"the hall ended with exit code {self._process.wait()}")

    def close(self) -> None:
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait()


@functools.cache
def _hall() -> Hall:
    return Hall()


# inside the network


def serve() -> None:
    """Takes requests until its input ends."""
    die_with_parent()
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what is printed by accident must not look like an answer
    watchmen = Watchmen()
    _load()
    for line in sys.stdin:
        request = json.loads(line)
        answer = (
            _one(request)
            if "where" in request
            else {"stall_s": watchmen.longest_s(request["since_s"])}
        )
        answers.write(json.dumps({"number": request["number"], **answer}) + "\n")
        answers.flush()
    answers.close()


def _load() -> None:
    """What every call would otherwise load and compile for itself."""
    from epa_rt.config.rig import load_rig
    from epa_rt.models.plant_file import load_plant
    from sim_backend.bus.bus_plant import BusPlant

    for module in (
        "epa_rt.cli.main",
        "epa_rt.cli.run",
        "epa_rt.cli.sound_rig",
        "epa_rt.live.start",
        "epa_rt.logs.reader",
        "epa_rt.logs.recorder",
        "epa_rt.loop.startable",
        "drivers.backend",
        "drivers.backend_factory",
        "sim_backend.bus.emulated_bus",
        "tests.bus.driver.cases",
        "tests.bus.driver.homed",
        "tests.bus.faults.judged",
        "tests.bus.faults.traced",
    ):
        importlib.import_module(module)
    rig = load_rig(ROOT / "config/rigs/bench.yaml")
    plant = BusPlant(rig, load_plant(ROOT / "config/rigs" / rig.plant), 1)
    plant.warm_up()
    from epa_rt.cli.main import parser

    parser()
    gc.collect()
    gc.freeze()  # a call collects what it made itself, and copies no page of this


def _one(request: dict) -> dict:
    _take_down_interfaces()
    with tempfile.TemporaryFile("w+") as said, tempfile.TemporaryFile("w+") as told:
        child = os.fork()
        if child == 0:
            _run(request, said.fileno(), told)
        in_time = _wait(child)
        said.seek(0)
        told.seek(0)
        text = told.read()
        answer = (
            json.loads(text)
            if text
            else {"ok": False, "error": "died" if in_time else f"not done after {_LONGEST_S:g} s"}
        )
        return {**answer, "said": said.read()}


def _run(request: dict, said: int, told: object) -> None:
    """The forked child: one function, and out. Its group is its own, so that nothing of it stays
    behind.
    """
    try:
        os.setpgid(0, 0)
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        nothing = os.open(os.devnull, os.O_RDONLY)
        for here, there in ((nothing, 0), (said, 1), (said, 2)):
            os.dup2(here, there)
        module, function = request["where"].split(":")
        result = getattr(importlib.import_module(module), function)(**request["arguments"])
        text = json.dumps({"ok": True, "result": result})
    except BaseException:
        text = json.dumps({"ok": False, "error": traceback.format_exc()})
    sys.stdout.flush()
    sys.stderr.flush()
    told.write(text)
    told.flush()
    os._exit(0)


def _wait(child: int) -> bool:
    """Whether it ended in time; whatever is left of its group is ended."""
    descriptor = os.pidfd_open(child)
    try:
        in_time = bool(select.select([descriptor], [], [], _LONGEST_S)[0])
    finally:
        os.close(descriptor)
    try:
        os.killpg(child, signal.SIGKILL)  # before it is waited for: until then its number is taken
    except (ProcessLookupError, PermissionError):
        pass
    os.waitpid(child, 0)
    return in_time


def _take_down_interfaces() -> None:
    """Those that a call has left which was ended; the kernel takes a moment to let go of a name."""
    import socket

    from sim_backend.bus.veth import remove

    for _ in range(100):
        left = [name for _number, name in socket.if_nameindex() if name != "lo"]
        if not left:
            return
        try:
            remove(left[0])
        except OSError:
            time.sleep(0.01)


if __name__ == "__main__":
    serve()
