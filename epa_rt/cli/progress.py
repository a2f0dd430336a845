"""Progress of long work: one bar on a terminal, a line per stage in a file."""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress_shown(quiet: bool) -> Iterator[Callable[[str, float], None]]:
    """Gives ``progress(stage, share)``: what is being done, and how much of it all is done (0 to
    1).
    """
    if quiet:
        yield lambda stage, share: None
    elif not sys.stderr.isatty():
        yield _lines()
    else:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeElapsedColumn(),
        )
        with Progress(
            *columns, console=Console(stderr=True, highlight=False), transient=True
        ) as bar:
            task = bar.add_task("opening", total=1.0)
            yield lambda stage, share: bar.update(
                task, description=stage, completed=min(max(share, 0.0), 1.0)
            )


def _lines() -> Callable[[str, float], None]:
    last = [""]

    def say(stage: str, share: float) -> None:
        if stage != last[0]:
            print(f"{100.0 * share:3.0f} % {stage}", file=sys.stderr)
        last[0] = stage

    return say


@contextmanager
def said_when_slow(sentence: str, after_s: float = 2.0) -> Iterator[None]:
    """Says ``sentence`` on standard error once what is done here has taken ``after_s`` seconds."""
    timer = threading.Timer(after_s, lambda: print(sentence, file=sys.stderr, flush=True))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
