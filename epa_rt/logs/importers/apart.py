"""Reads a file in a process of its own, with bounds on memory and time: readers in C may crash or
ask for any amount on a damaged file, which must not take the verb along.
"""

import json
import os
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from epa_rt.logs.importers.table import ImportRefused

LONGEST_S = 120.0
_KINDS = ("<f8", "<i8")

Answer = tuple[dict[str, Any], dict[str, np.ndarray]]


class Unreadable(Exception):
    """Why the file cannot be read, in words that stand in brackets."""


def read_apart(reader: str, request: dict[str, Any], own_bytes: int) -> Answer:
    """What a reader's ``main`` answers: facts as JSON has them, and columns.

    ``reader``: a module of this package; ``own_bytes``: memory that it may take beside its code.
    Raises ImportRefused for what the reader refuses, Unreadable where it cannot go on.
    """
    root = str(Path(__file__).parents[3])
    paths = os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")]))
    bounds = {
        "PYTHONPATH": paths,
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        "ARROW_DEFAULT_MEMORY_POOL": "system",
    }
    words = [sys.executable, "-m", f"{__package__}.{reader}", str(own_bytes), json.dumps(request)]
    try:
        done = subprocess.run(
            words, capture_output=True, timeout=LONGEST_S, env=os.environ | bounds
        )
    except subprocess.TimeoutExpired:
        raise Unreadable("reading it takes over two minutes") from None
    except (OSError, ValueError) as error:
        raise Unreadable(f"no process can be started to read it: {error}") from None
    at = done.stdout.find(b"\n") + 1
    if done.returncode or not at:
        raise Unreadable("its reader crashes on it")
    facts = json.loads(done.stdout[:at])
    if facts.get("refused"):
        raise ImportRefused(facts["refused"])
    if facts.get("unreadable"):
        raise Unreadable(facts["unreadable"])
    columns = {}
    for name, kind, rows in facts.pop("columns"):
        columns[name] = np.frombuffer(done.stdout, np.dtype(_KINDS[kind]), rows, at)
        at += 8 * rows
    return facts, columns


def serve(answer: Callable[[dict[str, Any]], Answer]) -> None:
    """The reader's side: bounds its memory, answers the request of its command line."""
    request = json.loads(sys.argv[2])
    _limit_memory(int(sys.argv[1]))
    columns: dict[str, np.ndarray] = {}
    try:
        facts, columns = answer(request)
    except ImportRefused as error:
        facts = {"refused": str(error)}
    except MemoryError:
        facts = {"unreadable": "it asks for more memory than a file of its size needs"}
    except RecursionError:
        facts = {"unreadable": "it is nested too deep"}
    except Exception as error:  # a damaged file makes a library raise nearly anything
        text = "".join(c if c.isprintable() else " " for c in str(error)[:400])
        facts = {"unreadable": f"{type(error).__name__}: {' '.join(text.split())[:120]}"}
    facts["columns"] = [
        [name, int(values.dtype.kind == "i"), len(values)] for name, values in columns.items()
    ]
    sys.stdout.buffer.write(json.dumps(facts).encode() + b"\n")
    for values in columns.values():
        kind = np.dtype(_KINDS[int(values.dtype.kind == "i")])
        sys.stdout.buffer.write(np.ascontiguousarray(values, kind).data)
    sys.stdout.buffer.flush()
    os._exit(0)  # a library that was stopped for want of memory may crash while it is taken down


def _limit_memory(own_bytes: int) -> None:
    with open("/proc/self/statm", encoding="ascii") as file:
        mapped = int(file.read().split()[0]) * resource.getpagesize()
    limit, hard = mapped + own_bytes, resource.getrlimit(resource.RLIMIT_AS)[1]
    if hard != resource.RLIM_INFINITY:
        limit = min(limit, hard)
    resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
