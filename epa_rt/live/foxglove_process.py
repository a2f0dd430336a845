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
from pathlib import Path

from epa_rt.live.attach import NotOn, attach_soon
from epa_rt.live.step_aside import step_aside

WAIT_S = 30.0  # for the run to begin, once its log has a name


def main() -> int:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # a terminal that closes is the run's to hear
    line = sys.stdin.readline()
    if not line:
        return 0
    given = json.loads(line)
    step_aside(given.pop("core"))  # before the server's threads are there, which inherit it
    from epa_rt.live.foxglove_server import RunServer, ServerSpec, is_free

    # What a client does wrong is no matter of the operator's, and must not fill their screen.
    logging.getLogger("foxglove").setLevel(logging.CRITICAL)
    spec = ServerSpec(**given)
    why = is_free(spec.host, spec.port)
    if why:
        return _say({"error": why})
    try:
        server = RunServer(spec)
    except (OSError, RuntimeError, ValueError) as error:
        return _say({"error": str(error)})
    _say({"port": server.port})
    try:
        log = sys.stdin.readline().strip()
        if log:
            _follow(server, Path(json.loads(log)))
    finally:
        server.close()
    return 0


def _follow(server: object, log: Path) -> None:
    from epa_rt.live.foxglove_server import RunServer

    assert isinstance(server, RunServer)
    try:
        with attach_soon(log, on_screen=False, wait_s=WAIT_S) as attached:
            server.follow(attached)
    except NotOn as error:
        print(f"no Foxglove view: {error}", file=sys.stderr)


def _say(words: dict[str, object]) -> int:
    os.write(1, json.dumps(words).encode() + b"\n")
    return 0


if __name__ == "__main__":
    code = main()
    os._exit(code)  # the server's own leave-taking waits for clients that hang
