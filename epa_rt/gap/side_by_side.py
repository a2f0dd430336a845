"""Work on both processors: the models release the interpreter's lock, and so do long sums.

What is worked on side by side may itself ask for help: it gets it where one of the threads has run
out of work, and does its work alone where none has.
"""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

WORKERS = 2
_helpers = threading.BoundedSemaphore(WORKERS - 1)


def each(function: Callable, items: Sequence) -> list:
    """``function`` of every item, in order; they are begun in order too. Raises what it raises for
    the first item that fails; hardly anything is begun after that.
    """
    if len(items) < 2 or not _helpers.acquire(blocking=False):
        return [function(item) for item in items]
    shared = _Shared(function, items)
    try:
        with ThreadPoolExecutor(1) as pool:
            try:
                helper = pool.submit(shared.work)
                shared.work()
                helper.result()
            except BaseException:
                shared.over.set()  # an interruption while the helper still works
                raise
    finally:
        shared.leave()
    if shared.errors:
        raise shared.errors[min(shared.errors)]
    return shared.found


class _Shared:
    """Items that a caller and its helper take by turns. ``errors``: number of an item to what it
    raised.
    """

    def __init__(self, function: Callable, items: Sequence) -> None:
        self.found, self.errors, self.over = [None] * len(items), {}, threading.Event()
        self._function, self._items, self._left, self._stays = (
            function,
            items,
            iter(range(len(items))),
            threading.Semaphore(1),
        )

    def work(self) -> None:
        try:
            for i in (
                self._left
            ):  # one thread at a time takes the next: the interpreter's lock guards that
                if self.over.is_set():
                    return
                try:
                    self.found[i] = self._function(self._items[i])
                except Exception as error:
                    self.errors[i] = error
                    self.over.set()
        except BaseException:
            self.over.set()
            raise
        finally:
            self.leave()

    def leave(self) -> None:
        """The first to leave sets a helper free: what the other one still works on may be helped
        with.
        """
        if self._stays.acquire(blocking=False):
            _helpers.release()
