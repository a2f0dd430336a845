"""One emulator process: bus, socket, control channel, and an orderly end."""

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sim_backend.bus import answers
from sim_backend.bus.control import ControlServer
from sim_backend.bus.emulated_bus import EmulatedBus
from sim_backend.bus.server import Server, open_interface, prefer


def serve(
    bus: EmulatedBus,
    interface: str,
    control: Path | None,
    priority: int | None,
    ready: Callable[[str], None],
) -> None:
    """Serves a bus on an interface until SIGTERM, SIGINT or a 'stop' on the control channel. Raises
    OSError.
    """
    with open_interface(interface) as packets:
        server = Server(bus, packets)
        channel = (
            None
            if control is None
            else ControlServer(
                control, server.handlers, lambda request: _answer(bus, server, request)
            )
        )
        before = {
            number: signal.signal(number, lambda *_: server.stop())
            for number in (signal.SIGTERM, signal.SIGINT)
        }
        try:
            sentence = prefer(priority)
            server.warm_up()
            ready(sentence)
            server.run()
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
            if channel is not None:
                channel.close()


def _answer(bus: EmulatedBus, server: Server, request: dict[str, Any]) -> dict[str, Any]:
    """One request of the control channel. Raises ValueError or KeyError, which becomes the answer's
    sentence.
    """
    do = request.pop("do", None)
    if do == "status":
        return answers.status(bus)
    if do == "truth":
        return answers.truth(bus)
    if do == "rewind":
        bus.rewind()
        return {}
    if do == "fault":
        return {"fault": answers.fault(bus.faults.add(**request))}
    if do == "faults":
        return {"faults": [answers.fault(fault) for fault in bus.faults.listed()]}
    if do == "clear":
        bus.faults.clear()
        return {}
    if do == "stop":
        server.stop()
        return {}
    raise ValueError(f"found {do!r}, expected status, truth, rewind, fault, faults, clear or stop")
