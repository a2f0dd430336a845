"""Work on blind cases in processes side by side, with what is done counted on standard error."""

import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from itertools import islice
from multiprocessing import active_children, get_context
from typing import TypeVar

from epa_rt.cli.gap.beside import end_with_parent

Made = TypeVar("Made")


def side_by_side(
    jobs: int, work: Callable[..., Made], asked: Sequence[tuple], says: str
) -> Iterator[Made]:
    """What ``work`` gives for each tuple of arguments, as each is done, by ``jobs`` processes that
    are started anew. ``says``: what is counted, 'cases made'.

    No process is given more than it works on, so that after Ctrl-C, or an error, nothing else
    begins, and what is under way is ended.
    """
    others = set(active_children())
    pool = ProcessPoolExecutor(jobs, get_context("spawn"), end_with_parent)
    try:
        waiting, n = iter(asked), 0
        running = {pool.submit(work, *arguments) for arguments in islice(waiting, jobs)}
        while running:
            done, running = wait(running, return_when=FIRST_COMPLETED)
            results = [one.result() for one in done]
            running |= {pool.submit(work, *arguments) for arguments in islice(waiting, len(done))}
            for made in results:
                n += 1
                print(
                    f"\r{n} of {len(asked)} {says}",
                    end="" if n < len(asked) else "\n",
                    file=sys.stderr,
                    flush=True,
                )
                yield made
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in set(active_children()) - others:
            process.terminate()
        raise
    pool.shutdown()
