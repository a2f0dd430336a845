"""An emulated bus beside a test: network and emulator of their own, commands to it by function.

``bus_case`` runs a function of ``cases.py`` in a user and network namespace of its own and gives its result back; where
the machine refuses that, the test is skipped.
"""

import json
import multiprocessing
import os
import socket
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest

from epa_rt.config.rig import Rig

ROOT = Path(__file__).resolve().parents[3]
MASTER_END, SLAVE_END = "ve0", "ve1"
NAMESPACE = ("unshare", "--user", "--map-root-user", "--net")
_LONGEST_S = 240


def bus_case(name: str, **arguments: object) -> dict:
    """Runs ``cases.NAME(**arguments)`` where it has a bus; what it returns must be JSON."""
    need_namespace()
    done = subprocess.run([*NAMESPACE, sys.executable, "-W", "error", __file__, name, json.dumps(arguments)], cwd=ROOT, capture_output=True,
                          text=True, timeout=_LONGEST_S, check=False, env={**os.environ, "PYTHONPATH": str(ROOT)})
    assert done.returncode == 0, f"{name} {arguments}:\n{done.stdout[-4000:]}\n{done.stderr[-6000:]}"
    return json.loads(done.stdout.splitlines()[-1])


@cache
def _refusal() -> str:
    try:
        allowed = subprocess.run([*NAMESPACE, "true"], capture_output=True, text=True, timeout=30, check=False)
    except FileNotFoundError:
        return "the command unshare is missing"
    return f"this machine grants no network of one's own: {allowed.stderr.strip()}" if allowed.returncode else ""


def need_namespace() -> None:
    """Skips the test where this machine grants no network of one's own."""
    if _refusal():
        pytest.skip(_refusal())


class Remote:
    """The emulator in its own process. ``do(function, ...)`` calls ``function(bus, ...)`` there and gives the result."""

    def __init__(self, pipe: "multiprocessing.connection.Connection"):
        self._pipe = pipe

    def do(self, function: Callable, *arguments: object) -> object:
        self._pipe.send((function, arguments))
        ok, result = self._pipe.recv()
        if not ok:
            raise RuntimeError(f"in the emulator:\n{result}")
        return result


@contextmanager
def emulated(rig: Rig, lock_step: bool = False, **options: object) -> Iterator[Remote]:
    """A veth pair with the rig's emulated bus on one end; the driver takes MASTER_END. ``options`` go to EmulatedBus."""
    from epa_rt.models.plant_file import load_plant
    from sim_backend.bus.emulated_bus import EmulatedBus
    from sim_backend.bus.server import open_interface
    from sim_backend.bus.veth import make_pair, remove

    make_pair(MASTER_END, SLAVE_END)
    bus = EmulatedBus(rig, load_plant(ROOT / "config/plants" / Path(rig.plant).name), 1, lock_step, **options)
    bus.plant.warm_up()
    packets = open_interface(SLAVE_END)
    ours, theirs = multiprocessing.get_context("fork").Pipe()
    child = multiprocessing.get_context("fork").Process(target=_serve, args=(bus, packets, theirs), daemon=True)
    child.start()
    theirs.close()
    packets.close()
    remote = Remote(ours)
    remote.do(_is_there)
    try:
        yield remote
    finally:
        child.terminate()
        child.join()
        remove(MASTER_END)


def _is_there(_bus: object) -> bool:
    return True


def _serve(bus: object, packets: socket.socket, pipe: "multiprocessing.connection.Connection") -> None:
    from sim_backend.bus.server import Server

    server = Server(bus, packets)

    def obey() -> None:
        try:
            function, arguments = pipe.recv()
        except EOFError:
            server.stop()
            return
        try:
            pipe.send((True, function(bus, *arguments)))
        except Exception:
            pipe.send((False, traceback.format_exc()))

    server.handlers[pipe.fileno()] = obey
    server.run()


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))
    import cases

    print(json.dumps(getattr(cases, sys.argv[1])(**json.loads(sys.argv[2]))))
