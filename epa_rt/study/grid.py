"""Grids of points: on all cores or a Dask cluster, every result stored as it comes, so that a
broken run goes on where it was.
"""

import hashlib
import json
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

Point = tuple[float, ...]
Found = dict[str, Any]  # numbers, or lists of them; NaN only alone
Task = Callable[[Point], Found]
CHUNK = (
    6  # points per job: small enough that little is lost, large enough that sending does not matter
)
ROOMS = ("epa_rt/models", "epa_rt/study")  # whose code a result depends on
LOOP_ROOMS = (
    "epa_rt/config",
    "epa_rt/control",
    "epa_rt/experiments",
    "epa_rt/logs",
    "epa_rt/loop",
    "epa_rt/safety",
    "epa_rt/signals",
    "sim_backend",
)
ADDRESS = re.compile(r"(\w+://)?(\[[0-9A-Fa-f:]+\]|[^:/\[\]\s]+):\d{1,5}")
_ROOT = Path(__file__).resolve().parents[2]


class GridError(Exception):
    """One sentence: what was found, what was expected."""


class How(NamedTuple):
    """Where a grid runs. ``cluster``: address of a Dask scheduler (tcp://...), else ``jobs`` of
    this machine (-1: all cores).
    """

    jobs: int = -1
    cluster: str | None = None
    threads: bool = True  # compiled tasks let other threads run; tasks in Python want processes
    chunk: int = CHUNK


def code_digest(rooms: Sequence[str] = ROOMS) -> str:
    """Digest of the code that results depend on: what computes them, not what draws or judges
    them.
    """
    digest = hashlib.sha256()
    for room in rooms:
        for file in sorted((_ROOT / room).rglob("*.py")):
            if "report" not in file.parts and "claims" not in file.name:
                digest.update(
                    file.relative_to(_ROOT).as_posix().encode() + b"\0" + file.read_bytes()
                )
    return digest.hexdigest()


def key_of(*inputs: Any) -> str:
    """Key of a grid's inputs (bytes, numbers, text) and the code's version."""
    digest = hashlib.sha256(code_digest().encode())
    for one in inputs:
        digest.update(one if isinstance(one, bytes) else repr(one).encode())
        digest.update(b"\0")
    return digest.hexdigest()[:24]


class Store:
    """Results of one grid in one file: a JSON line per point, found by the key of its inputs.
    ``folder`` None: kept nowhere.
    """

    def __init__(self, folder: Path | None, name: str, key: str):
        self.path = folder / f"{name}-{key}.jsonl" if folder else None

    def read(self) -> dict[Point, Found]:
        """What is there. A line that was cut off or spoilt is left out. Raises GridError where the
        file cannot be read.
        """
        found: dict[Point, Found] = {}
        if self.path is None:
            return found
        try:
            lines = self.path.read_text("utf-8", errors="replace").splitlines()
        except (FileNotFoundError, NotADirectoryError):  # add() says what is wrong with the folder
            return found
        except OSError as error:
            raise GridError(f"{self.path}: cannot be read ({error.strerror})") from None
        for line in lines:
            try:
                held = json.loads(line)
                found[tuple(map(float, held["at"]))] = {
                    name: _number(value) for name, value in held["found"].items()
                }
            except (ValueError, KeyError, TypeError, AttributeError):
                continue
        return _alike(found)

    def add(self, results: Sequence[tuple[Point, Found]]) -> None:
        """Appends whole lines. Raises GridError where it cannot write."""
        if self.path is None:
            return
        lines = [
            json.dumps(
                {
                    "at": at,
                    "found": {
                        name: None if value != value else value for name, value in found.items()
                    },
                }
            )
            for at, found in results
        ]
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with self.path.open("a", encoding="utf-8") as file:
                file.write(
                    "".join(f"\n{line}" for line in lines) + "\n"
                )  # the leading newline ends a line that was cut off
        except OSError as error:
            raise GridError(f"{self.path}: cannot be written ({error.strerror})") from None


def _number(value: Any) -> float | list[float]:
    if isinstance(value, list):
        return [float(one) for one in value]
    return math.nan if value is None else float(value)


def _alike(found: dict[Point, Found]) -> dict[Point, Found]:
    """Those that have the figures that most have: a line that lost one is computed again."""
    names = [frozenset(one) for one in found.values()]
    usual = max(set(names), key=names.count, default=frozenset())
    return {at: one for at, one in found.items() if frozenset(one) == usual}


def solve(
    task: Task,
    points: Sequence[Point],
    store: Store,
    how: How = How(),
    progress: Callable[[str, float], None] = lambda stage, share: None,
    stage: str = "points",
) -> list[Found]:
    """``task`` at every point, in the points' order; those in ``store`` are not computed again.

    ``task`` must be picklable. Raises GridError (no cluster at the address, no place for results).
    """
    known = store.read()
    missing = [at for at in points if at not in known]
    progress(stage, 1.0 - len(missing) / max(len(points), 1))
    chunks = [missing[i : i + how.chunk] for i in range(0, len(missing), how.chunk)]
    for results in _run(task, chunks, how):
        store.add(results)
        known.update(results)
        missing_now = len(points) - sum(1 for at in points if at in known)
        progress(stage, 1.0 - missing_now / len(points))
    return [known[at] for at in points]


def _chunk(task: Task, points: Sequence[Point]) -> list[tuple[Point, Found]]:
    return [(at, task(at)) for at in points]


def _run(task: Task, chunks: Sequence[Sequence[Point]], how: How):
    """Yields each chunk's results as they come."""
    if not chunks:
        return
    if how.cluster is None and how.jobs == 1:
        for points in chunks:
            yield _chunk(task, points)
        return
    from joblib import Parallel, delayed, parallel_config

    jobs = [delayed(_chunk)(task, points) for points in chunks]
    if how.cluster is None:
        yield from Parallel(
            n_jobs=how.jobs,
            backend="threading" if how.threads else "loky",
            return_as="generator_unordered",
        )(jobs)
        return
    client = _client(how.cluster)
    try:
        with parallel_config(backend="dask", client=client):
            yield from Parallel(n_jobs=-1, return_as="generator_unordered")(jobs)
    finally:
        client.close()


def _client(address: str):
    from distributed import Client

    wanted = "expected an address such as tcp://host:8786"
    if not ADDRESS.fullmatch(
        address
    ):  # a client that was made of such a one complains when it is cleaned up
        raise GridError(f"--cluster: found no Dask scheduler at {address} (no HOST:PORT), {wanted}")
    try:
        return Client(address, timeout="5s", set_as_default=False)
    except (
        Exception
    ) as error:  # what a bad address raises depends on how it is bad, up to a bare RuntimeError
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise GridError(
            f"--cluster: found no Dask scheduler at {address} ({reason[:120]}), {wanted}"
        ) from None
