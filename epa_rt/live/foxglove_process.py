"""The process of `--foxglove`: a WebSocket server for one run, apart from its loop.

Standard input: one line of JSON (`ServerSpec`, and the core to keep off), then one with the log.
Standard output: one line, the port or what is wrong, before anything of the run moves.
"""

from __future__ import annotations

import json
import logging
import os
import signal
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.live.attach import NotOn, attach_soon
from epa_rt.live.reserved_port import ReservedPort
from epa_rt.live.step_aside import step_aside

if TYPE_CHECKING:
    from epa_rt.live.foxglove_server import ServerSpec

WAIT_S = 30.0  # for the run to begin, once its log has a name


def main() -> int:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # a terminal that closes is the run's to hear
    line = sys.stdin.readline()
    if not line:
        return 0
    given = json.loads(line)
    step_aside(given.pop("core"))  # before the server's threads are there, which inherit it
    # What a client does wrong is no matter of the operator's, and must not fill their screen.
    logging.getLogger("foxglove").setLevel(logging.CRITICAL)
    from epa_rt.live.foxglove_server import ServerSpec

    spec = ServerSpec(**given)
    try:
        reserved = ReservedPort(spec.host, spec.port)
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else None
        return _say({"error": why or str(error)})
    with reserved:
        _say({"port": reserved.port})
        log = sys.stdin.readline().strip()
        if log:
            _serve(replace(spec, port=reserved.port), Path(json.loads(log)))
    return 0


def _serve(spec: ServerSpec, log: Path) -> None:
    from epa_rt.live.foxglove_server import RunServer

    try:
        with attach_soon(log, on_screen=False, wait_s=WAIT_S) as attached:
            server = RunServer(spec, attached)
            try:
                server.follow()
            finally:
                server.close()
    except (NotOn, OSError, RuntimeError, ValueError) as error:
        print(f"no Foxglove view: {error}", file=sys.stderr)


def _say(words: dict[str, object]) -> int:
    os.write(1, json.dumps(words).encode() + b"\n")
    return 0


if __name__ == "__main__":
    code = main()
    os._exit(code)  # the server's own leave-taking waits for clients that hang
