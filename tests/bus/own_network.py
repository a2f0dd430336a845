"""Functions of the tests in a network of their own: ``call("tests.bus.driver.cases:opens", rig="bench")``.

`unshare` starts one hall per test process. It loads what is heavy once and forks for every call, so that a call costs some
milliseconds and meets nothing that another has left. ``checked`` is for what runs by the clock: watchmen, one pinned to
each core, measure how long this machine let no ordinary process run, and a check that fails beside such a stall is
repeated, twice at most, and told of at the end of the tests.
"""

import atexit
import functools
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

import pytest

from sim_backend.bus.namespace import die_with_parent, refusal
from tests.bus.watchmen import Watchmen

ROOT = Path(__file__).resolve().parents[2]
UNSHARE = ("unshare", "--user", "--map-root-user", "--net")
STALL_S = 0.05  # longer than any ordinary process waits for its turn on two busy cores
TRIES = 3
_LONGEST_S = 240.0  # a bound for what hangs, not a figure
STALLS: list[str] = []  # what was repeated, for the summary
REAL_TIME = pytest.mark.xdist_group("real time")  # one after the other: two at once would be each other's noise


class CallFailed(AssertionError):
    """The function raised, or hung; with what it printed."""


@functools.cache
def why_not() -> str | None:
    """Why no network of one's own can be had here; None where it can."""
    return refusal()


def call(where: str, **arguments: object) -> object:
    """Runs ``module:function(**arguments)`` in the hall; all of it JSON. Raises CallFailed."""
    return _asked(where, arguments)[0]


def checked(check: Callable[[dict], None], where: str, longest_stall_s: float = STALL_S, **arguments: object) -> dict:
    """The same, and ``check(result)``, which asserts. Only a stall of more than ``longest_stall_s`` that the watchmen saw
    makes a failure run again: what the machine did not do must not be read as what the driver does.
    """
    for tried in range(1, TRIES + 1):
        stalls: list[float] = []
        try:
            result = _asked(where, arguments, stalls)[0]
            check(result)
            return result
        except AssertionError as error:
            if tried == TRIES or not stalls or stalls[0] < longest_stall_s:
                raise
            first = str(error).strip().splitlines()[0][:160] if str(error).strip() else "an assertion"
            STALLS.append(f"{where} {arguments or ''}: run {tried} failed ({first}) while this machine stood still for {stalls[0]:.2f} s; run again")
    raise AssertionError("never here")


def _asked(where: str, arguments: dict, stalls: list[float] | None = None) -> tuple[object, str]:
    answer = _hall().ask({"where": where, "arguments": arguments})
    if stalls is not None:
        stalls.append(answer["stall_s"])
    if not answer["ok"]:
        raise CallFailed(f"{where} {arguments}: {answer['error']}\n{answer['said'][-6000:]}")
    return answer["result"], answer["said"]


class Hall:
    """The process in the network, as seen from outside. ``ask`` is for one caller at a time."""

    def __init__(self):
        self._process = subprocess.Popen([*UNSHARE, sys.executable, "-W", "error", "-m", "tests.bus.own_network"], cwd=ROOT, stdin=subprocess.PIPE,
                                         stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)})
        self._number = 0
        atexit.register(self.close)

    def ask(self, request: dict) -> dict:
        self._number += 1
        self._process.stdin.write(json.dumps({**request, "number": self._number}) + "\n")
        self._process.stdin.flush()
        for line in self._process.stdout:
            answer = json.loads(line)
            if answer["number"] == self._number:  # an older one belongs to a test that ran out of its time
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
        answers.write(json.dumps({"number": request["number"], **_one(request, watchmen)}) + "\n")
        answers.flush()
    answers.close()


def _load() -> None:
    """What every call would otherwise load and compile for itself."""
    from epa_rt.config.rig import load_rig
    from epa_rt.models.plant_file import load_plant
    from sim_backend.bus.bus_plant import BusPlant

    for module in ("epa_rt.cli.main", "epa_rt.cli.run", "epa_rt.logs.reader", "epa_rt.logs.recorder", "drivers.backend", "sim_backend.bus.emulated_bus"):
        importlib.import_module(module)
    rig = load_rig(ROOT / "config/rigs/bench.yaml")
    plant = BusPlant(rig, load_plant(ROOT / "config/rigs" / rig.plant), 1)
    plant.warm_up()


def _one(request: dict, watchmen: Watchmen) -> dict:
    _take_down_interfaces()
    with tempfile.TemporaryFile("w+") as said, tempfile.TemporaryFile("w+") as told:
        watchmen.begin()
        child = os.fork()
        if child == 0:
            _run(request, said.fileno(), told)
        in_time = _wait(child)
        stall_s = watchmen.longest_s()
        said.seek(0)
        told.seek(0)
        text = told.read()
        answer = json.loads(text) if text else {"ok": False, "error": "died" if in_time else f"not done after {_LONGEST_S:g} s"}
        return {**answer, "said": said.read(), "stall_s": stall_s}


def _run(request: dict, said: int, told: object) -> None:
    """The forked child: one function, and out. Its group is its own, so that nothing of it stays behind."""
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
