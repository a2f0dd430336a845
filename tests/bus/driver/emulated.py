"""An emulated bus inside a network of one's own: the emulator in a process beside, commands to it
by function.
"""

import multiprocessing
import os
import socket
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from epa_rt.config.rig import Rig
from epa_rt.models.plant_file import load_plant
from sim_backend.bus.emulated_bus import EmulatedBus
from sim_backend.bus.server import Server, open_interface
from sim_backend.bus.veth import make_pair, remove

ROOT = Path(__file__).resolve().parents[3]
MASTER_END, SLAVE_END = "ve0", "ve1"


class Remote:
    """The emulator in its own process. ``do(function, ...)`` calls ``function(bus, ...)`` there and
    gives the result.
    """

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
    """A veth pair with the rig's emulated bus on one end; the driver takes MASTER_END. ``options``
    go to EmulatedBus.
    """
    with served(
        EmulatedBus(
            rig, load_plant(ROOT / "config/plants" / Path(rig.plant).name), 1, lock_step, **options
        )
    ) as remote:
        yield remote


@contextmanager
def served(bus: EmulatedBus) -> Iterator[Remote]:
    """The same with any emulated bus."""
    if bus.lock_step:
        _on_one_core()
    make_pair(MASTER_END, SLAVE_END)
    bus.plant.warm_up()
    packets = open_interface(SLAVE_END)
    fork = multiprocessing.get_context("fork")
    ours, theirs = fork.Pipe()
    child = fork.Process(target=_serve, args=(bus, packets, theirs), daemon=True)
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
        ours.close()
        remove(MASTER_END)


def _on_one_core() -> None:
    """This process and what it starts: in lock step one waits for the other, and to wake another
    core takes longer than a cycle does. Test processes are spread over the cores.
    """
    cores = sorted(os.sched_getaffinity(0))
    number = os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")
    os.sched_setaffinity(0, {cores[int(number) % len(cores)]})


def _is_there(_bus: EmulatedBus) -> bool:
    return True


def _serve(
    bus: EmulatedBus, packets: socket.socket, pipe: "multiprocessing.connection.Connection"
) -> None:
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
