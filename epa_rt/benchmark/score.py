"""Scoring: every case diagnosed by a process that cannot read the truth, the truth opened last, the
figures counted.
"""

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from epa_rt.benchmark.figures import figures
from epa_rt.benchmark.kept import hash_of, take, telling
from epa_rt.benchmark.seal import (
    NOT_HIDDEN,
    SealError,
    can_hide,
    hidden_command,
    opened,
    python_command,
)
from epa_rt.benchmark.shown import closing_line, table

LONGEST_S = 3600
STOPPED = (-2, -15, 130)  # exit codes of a worker that took the operator's Ctrl-C itself


Again = Callable[[list[tuple[dict, dict]], Path, Sequence[Path]], None]


def score(
    cases: Path,
    sealed: Path,
    out: Path,
    html: Path,
    diagnoser: str,
    jobs: int,
    again: Again | None = None,
    first: int | None = None,
    beside: Path | None = None,
) -> str:
    """Diagnoses what is not yet diagnosed, writes JSON and picture; returns the table and the
    closing line.

    Answers are kept beside ``out`` and are not asked for again. ``again`` is called with pairs
    (truth, said), the answers' folder and what is to be hidden, and may add an ``after_next`` to
    what was said. ``first``: so many cases alone. ``beside``: a file that tells the truth too.
    Raises SealError where the truth does not fit the logs, or the answers kept are others'.
    """
    folders = sorted(path.parent for path in cases.glob("case_*/case.json"))[:first]
    answers, hides = out.with_suffix(".answers"), can_hide()
    take(answers, cases, diagnoser)
    hidden = telling(sealed, answers.parent, html, *([beside] if beside else [])) if hides else []
    diagnose_all(folders, answers, hidden, diagnoser, jobs)
    truth = opened(sealed, cases)
    if first is not None:
        truth["cases"] = [case for case in truth["cases"] if cases / case["case"] in folders]
    missing = [
        case["case"] for case in truth["cases"] if not (answers / f"{case['case']}.json").exists()
    ]
    if missing:
        raise SealError(
            f"{cases}: found no {', '.join(missing[:5])}, expected every case that was sealed"
        )
    judged = [
        (case, json.loads((answers / f"{case['case']}.json").read_text(encoding="utf-8")))
        for case in truth["cases"]
    ]
    if again is not None:
        again(judged, answers, hidden)
    found = figures(judged)
    out.write_text(
        json.dumps(
            {
                "figures": [f._asdict() for f in found],
                "hidden_from_the_diagnosis": hides,
                "diagnoser": diagnoser,
                "truth_sha256": hash_of(cases),
                "cases": [{"truth": t, "said": s} for t, s in judged],
            },
            indent=1,
        ),
        encoding="utf-8",
    )
    from epa_rt.benchmark.confusion import confusion

    confusion(judged, html)
    warning = "" if hides else f"\n{NOT_HIDDEN}"
    return f"{table(found)}{warning}{_errors(judged, answers)}\n{closing_line(found)}"


def _errors(judged: Sequence[tuple[dict, dict]], answers: Path) -> str:
    """Which diagnoses ended in an error, a line each; they count as wrong, and are not asked again
    by themselves.
    """
    return "".join(
        f"\n{case['case']}: {said['error'].strip().splitlines()[-1][:300]} (asked again once"
        f" {answers / case['case']}.json is gone)"
        for case, said in judged
        if said.get("error")
    )


def diagnose_all(
    folders: list[Path], answers: Path, hidden: Sequence[Path], diagnoser: str, jobs: int
) -> None:
    """Every case's answer into ``answers``; what is there already is left as it is."""
    diagnose_each(
        [(folder, answers / f"{folder.name}.json") for folder in folders],
        hidden,
        diagnoser,
        jobs,
        "cases diagnosed",
    )


def diagnose_each(
    asked: list[tuple[Path, Path]], hidden: Sequence[Path], diagnoser: str, jobs: int, says: str
) -> None:
    """One process per folder and file for its answer, ``jobs`` at once; what is there already is
    left as it is. ``says``: what is counted, for people. ``hidden``: folders and files that are
    empty for those processes (kept.telling); none where nothing can be hidden.

    After Ctrl-C the cases under way have no answer and are asked again the next time.
    """
    waiting = [(folder, out) for folder, out in asked if not out.exists()]
    done, running = len(asked) - len(waiting), Running()

    def one(pair: tuple[Path, Path]) -> None:
        nonlocal done
        folder, out = pair
        diagnose_one(folder.resolve(), out.resolve(), hidden, diagnoser, running)
        done += out.exists()
        print(f"\r{done} of {len(asked)} {says}", end="", file=sys.stderr, flush=True)

    with ThreadPoolExecutor(jobs) as pool:
        try:
            list(pool.map(one, waiting))
        except BaseException:
            running.stop()
            raise
    if asked:
        print(file=sys.stderr)


class Running:
    """Processes under way, so that they can be ended together."""

    def __init__(self) -> None:
        self._lock, self._processes, self.stopped = threading.Lock(), set(), False

    def start(self, command: list[str], env: dict[str, str]) -> subprocess.Popen | None:
        """None once stopped."""
        with self._lock:
            if self.stopped:
                return None
            process = subprocess.Popen(
                command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
            )
            self._processes.add(process)
            return process

    def stop(self) -> None:
        """Asks all of them to end (SIGTERM) and lets none start any more; does not wait for
        them.
        """
        with self._lock:
            self.stopped = True
            for process in self._processes:
                process.terminate()


def diagnose_one(
    folder: Path, out: Path, hidden: Sequence[Path], diagnoser: str, running: Running
) -> None:
    """Runs the worker on one case; a process that dies leaves an answer that says so, one that was
    stopped leaves none.
    """
    command = python_command(
        "epa_rt.benchmark.worker", os.fspath(folder), os.fspath(out), diagnoser
    )
    if hidden:
        command = hidden_command(hidden, command)
    threads = {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    began_s = time.perf_counter()
    process = running.start(command, {**os.environ, **threads})
    if process is None:
        return
    try:
        _, said = process.communicate(timeout=LONGEST_S)
        reason = f"exit code {process.returncode}: {said[-2000:]}"
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        reason = f"no answer within {LONGEST_S} s"
    if not out.exists() and not running.stopped and process.returncode not in STOPPED:
        out.write_text(
            json.dumps({"error": reason, "wall_seconds": time.perf_counter() - began_s}),
            encoding="utf-8",
        )
