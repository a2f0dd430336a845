"""Work on blind cases in processes side by side, with what is done counted on standard error."""

import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import TypeVar

Made = TypeVar("Made")


def side_by_side(jobs: int, work: Callable[..., Made], asked: Sequence[tuple], says: str) -> Iterator[Made]:
    """What ``work`` gives for each tuple of arguments, as each is done, by ``jobs`` processes that are started anew. ``says``: what is counted, 'cases made'."""
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        waiting = [pool.submit(work, *arguments) for arguments in asked]
        for n, done in enumerate(as_completed(waiting), 1):
            made = done.result()
            print(f"\r{n} of {len(waiting)} {says}", end="" if n < len(waiting) else "\n", file=sys.stderr, flush=True)
            yield made
