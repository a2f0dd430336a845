"""epa as a process of its own, for tests that kill, interrupt or starve it, and within a test's."""

import contextlib
import io
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
EXPERIMENTS, RIGS = ROOT / "config/experiments", ROOT / "config/rigs"


def epa(*arguments: object, **options: object) -> subprocess.CompletedProcess:
    """Runs epa to its end; output as text."""
    command = [sys.executable, "-m", "epa_rt", *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600, **options)


def epa_here(*arguments: object) -> subprocess.CompletedProcess:
    """The same in this process, without the two seconds in which Python starts and loads."""
    from epa_rt.cli.main import main

    words, out, err = [str(one) for one in arguments], io.StringIO(), io.StringIO()
    with contextlib.chdir(ROOT), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main(words)
        except SystemExit as ended:  # what argparse refuses
            code = ended.code
    return subprocess.CompletedProcess(["epa", *words], code, out.getvalue(), err.getvalue())


def start(*arguments: object) -> subprocess.Popen:
    command = [sys.executable, "-m", "epa_rt", *map(str, arguments)]
    return subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def paced_run(out: Path, experiment: str = "knee_chirp", rig: str = "knee") -> subprocess.Popen:
    """A run in real time that is under way: its log has grown past bring-up."""
    process = start(
        "run",
        EXPERIMENTS / f"{experiment}.yaml",
        "--rig",
        RIGS / f"{rig}.yaml",
        "--speed",
        1,
        "-o",
        out,
        "--quiet",
    )
    wait_for(
        lambda: (
            process.poll() is not None
            or any(log.stat().st_size > 30_000 for log in out.glob("*.mcap"))
        )
    )
    if process.poll() is not None:
        raise AssertionError(f"the run ended early: {process.communicate()}")
    return process


def children_of(pid: int) -> list[int]:
    """Direct children, from /proc."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                stat = (entry / "stat").read_text()
            except OSError:
                continue
            if int(stat.rsplit(")", 1)[1].split()[1]) == pid:
                found.append(int(entry.name))
    return found


def wait_for(condition, seconds: float = 300.0) -> None:
    """Waits until the condition holds; AssertionError after ``seconds`` (a bound for a hung test,
    not a figure).
    """
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)


def gone(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"


__all__ = [
    "EXPERIMENTS",
    "RIGS",
    "ROOT",
    "children_of",
    "epa",
    "epa_here",
    "gone",
    "paced_run",
    "signal",
    "start",
    "wait_for",
]
