"""Work on both processors: the models release the interpreter's lock, and so do long sums.

What is worked on side by side may itself ask for help: it gets it where one of the threads has run out of work, and does its work alone where none has.
"""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

WORKERS = 2
_helpers = threading.BoundedSemaphore(WORKERS - 1)


def each(function: Callable, items: Sequence) -> list:
    """``function`` of every item, in order; they are begun in order too. Raises what the function raises; nothing is begun after that."""
    if len(items) < 2 or not _helpers.acquire(blocking=False):
        return [function(item) for item in items]
    found, left, failed, first = [None] * len(items), iter(range(len(items))), threading.Event(), threading.Semaphore(1)

    def work() -> None:
        try:
            for i in left:  # one thread at a time takes the next: the interpreter's lock guards that
                if failed.is_set():
                    return
                found[i] = function(items[i])
        except BaseException:
            failed.set()
            raise
        finally:
            if first.acquire(blocking=False):
                _helpers.release()  # the first of the two that is done: what the other one still works on may be helped with

    with ThreadPoolExecutor(1) as pool:
        helper = pool.submit(work)
        work()
    helper.result()
    return found
