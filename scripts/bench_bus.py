"""Wake-up lateness, round trip and cycle time at 1 kHz on the emulated bus: our driver and loop
with its recorder, beside a bare pysoem loop and beside cyclictest, in turns on the same core with
the same priority. JSON and a picture.

cyclictest and the bare loop run before, between and after the runs of the loop, so that all see the
same machine. Needs no right; without the right to SCHED_FIFO the figures are those of an ordinary
process, and the output says so.

    python scripts/bench_bus.py                                    a minute of the loop, about three
    in all python scripts/bench_bus.py --seconds 600 --slices 1           ten minutes in one run
    python scripts/bench_bus.py --seconds 120 --burn 2             beside two processes that burn
    the processor
"""

import argparse
import contextlib
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
BAR = {"lateness_p99_9_over_cyclictest": 1.5, "round_trip_median_over_bare": 1.3}
_HISTOGRAM_US = 20_000
_PERIOD_NS = 1_000_000
_COUNTS = (
    "cycles",
    "recorded",
    "lost_samples",
    "duplicated",
    "overruns_counted",
    "overruns_flagged",
    "overruns_late",
    "edges_missed",
    "bad_cycles",
)


def percentiles(values_us: np.ndarray) -> dict[str, float]:
    p50, p99, p999 = np.percentile(values_us, (50, 99, 99.9))
    return {
        "median_us": round(float(p50), 2),
        "p99_us": round(float(p99), 2),
        "p99_9_us": round(float(p999), 2),
        "max_us": round(float(values_us.max()), 1),
        "samples": int(values_us.size),
    }


def cyclictest(seconds: float, core: int, priority: int) -> np.ndarray:
    """Wake-up latencies in us, rebuilt from its histogram of 1 us steps (each as the middle of its
    step).
    """
    with tempfile.TemporaryDirectory() as folder:
        found = Path(folder, "found.json")
        subprocess.run(
            [
                "cyclictest",
                "-m",
                "-q",
                "-i",
                "1000",
                "-t",
                "1",
                "-a",
                str(core),
                "-p",
                str(priority),
                "-h",
                str(_HISTOGRAM_US),
                "-D",
                str(max(1, round(seconds))),
                f"--json={found}",
            ],
            check=True,
            capture_output=True,
            timeout=seconds + 60,
        )
        thread = json.loads(found.read_text())["thread"]["0"]
    counts = {int(us): n for us, n in thread["histogram"].items()}
    beyond = thread["cycles"] - sum(counts.values())
    return np.concatenate(
        [
            np.repeat([us + 0.5 for us in counts], list(counts.values())),
            np.full(max(0, beyond), float(thread["max"])),
        ]
    )


def loop(which: str, chosen: argparse.Namespace, seconds: float) -> dict[str, np.ndarray]:
    """One of the two loops of bench_bus_loops.py beside an emulator of its own, which has the core
    and one priority more.
    """
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "found.npz")
        call = (
            f"import sys; sys.path[:0] = [{str(ROOT)!r}, {str(ROOT / 'scripts')!r}]; from pathlib"
            f" import Path; import bench_bus_loops; bench_bus_loops.main({which!r},"
            f" Path({str(chosen.rig)!r}), Path({str(chosen.experiment)!r}),"
            f" {round(seconds * 1e9 / _PERIOD_NS)}, {chosen.core}, {chosen.priority},"
            f" Path({str(out)!r}))"
        )
        done = run_beside(
            [sys.executable, "-c", call],
            chosen.rig,
            ["--priority", str(chosen.priority + 1)],
            2 * seconds + 180,
        )
        if done.returncode or not out.exists():
            sys.exit(
                f"the {which} loop ended with exit code"
                f" {done.returncode}:\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
            )
        with np.load(out) as found:
            return {name: found[name] for name in found.files}


def run_beside(
    command: list[str], rig: Path, serve_arguments: list[str], timeout_s: float
) -> subprocess.CompletedProcess:
    """As sim_backend.bus.namespace does it, but for root without a user namespace, in which not
    even root may SCHED_FIFO.
    """
    from sim_backend.bus.namespace import command_beside, run_line

    line = command_beside(command, rig, serve_arguments)
    if os.geteuid() == 0:
        line = [word for word in line if word not in ("--user", "--map-root-user")]
    return run_line(line, timeout_s)


@contextlib.contextmanager
def burning(processes: int) -> Iterator[None]:
    """So many processes of ordinary priority that never rest, on any core."""
    burners = [
        subprocess.Popen(
            [sys.executable, "-c", "while True: pass"],
            preexec_fn=lambda: os.sched_setaffinity(0, range(os.cpu_count() or 1)),
        )
        for _ in range(processes)
    ]
    try:
        yield
    finally:
        for burner in burners:
            burner.kill()
            burner.wait()


def raise_limits() -> None:
    """As far as this user may: in a user namespace capabilities count for nothing, these limits
    do.
    """
    for limit in (resource.RLIMIT_RTPRIO, resource.RLIMIT_MEMLOCK):
        wanted = 99 if limit == resource.RLIMIT_RTPRIO else resource.RLIM_INFINITY
        try:
            resource.setrlimit(limit, (wanted, wanted))
        except (ValueError, OSError):
            resource.setrlimit(limit, (resource.getrlimit(limit)[1],) * 2)


def may_fifo(priority: int) -> bool:
    code = f"import os; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param({priority}))"
    return subprocess.run([sys.executable, "-c", code], capture_output=True).returncode == 0


@contextlib.contextmanager
def awake(wanted: bool) -> Iterator[str]:
    """Keeps the cores from deep sleep for all three alike, as cyclictest does by itself; needs the
    right to.
    """
    try:
        hold = os.open("/dev/cpu_dma_latency", os.O_WRONLY) if wanted else None
    except OSError as error:
        yield f"not held awake ({error.strerror})"
        return
    if hold is None:
        yield "as they are"
        return
    os.write(hold, bytes(4))
    try:
        yield "held awake (/dev/cpu_dma_latency 0)"
    finally:
        os.close(hold)


def measure(chosen: argparse.Namespace) -> dict[str, list]:
    """The turns: beside, then slice by slice the loop and beside again."""
    fifo = may_fifo(chosen.priority)
    has = fifo and shutil.which("cyclictest") is not None  # it gives up where it may not SCHED_FIFO
    part = chosen.beside / (chosen.slices + 1)
    found: dict[str, list] = {"cyclictest": [], "bare": [], "epa": [], "fifo": [fifo]}

    def beside() -> None:
        if has:
            found["cyclictest"].append(cyclictest(part, chosen.core, chosen.priority))
        found["bare"].append(loop("bare", chosen, part))

    beside()
    for n in range(chosen.slices):
        found["epa"].append(loop("epa", chosen, chosen.seconds / chosen.slices))
        print(f"run {n + 1} of {chosen.slices} done", file=sys.stderr, flush=True)
        beside()
    return found


def joined(runs: list[dict[str, np.ndarray]], name: str) -> np.ndarray:
    """One quantity of all runs, in us."""
    if name == "cycle_time":
        return np.concatenate([np.diff(run["woken_ns"]) for run in runs]) / 1e3
    return np.concatenate([run[f"{name}_ns"] for run in runs]) / 1e3


def report_of(found: dict[str, list], chosen: argparse.Namespace, sleep: str) -> dict:
    """All figures. ``accounted``: no sample is missing or there twice; every late cycle is counted
    by the loop and flagged in the log; every edge without a cycle lies in the lateness of the cycle
    before.
    """
    epa = {
        name: percentiles(joined(found["epa"], name))
        for name in ("lateness", "round_trip", "cycle_time", "busy")
    }
    bare = {
        name: percentiles(joined(found["bare"], name))
        for name in ("lateness", "round_trip", "cycle_time")
    }
    counts = {name: sum(int(run[name][0]) for run in found["epa"]) for name in _COUNTS}
    reference = percentiles(np.concatenate(found["cyclictest"])) if found["cyclictest"] else None
    ratios = {
        "round_trip_median_over_bare": round(
            epa["round_trip"]["median_us"] / bare["round_trip"]["median_us"], 3
        )
    }
    if reference:
        ratios["lateness_p99_9_over_cyclictest"] = round(
            epa["lateness"]["p99_9_us"] / reference["p99_9_us"], 3
        )
        ratios["bare_lateness_p99_9_over_cyclictest"] = round(
            bare["lateness"]["p99_9_us"] / reference["p99_9_us"], 3
        )
    counts["edges_missed_by_lateness"] = sum(
        int((run["lateness_ns"][:-1] // _PERIOD_NS).sum()) for run in found["epa"]
    )
    counts["accounted"] = (
        counts["lost_samples"] == counts["duplicated"] == 0
        and counts["edges_missed"] == counts["edges_missed_by_lateness"]
        and counts["overruns_counted"] == counts["overruns_flagged"] == counts["overruns_late"]
        and all(run["log_whole"][0] for run in found["epa"])
    )
    by_slice = [
        {
            "epa_lateness": percentiles(joined([run], "lateness")),
            "epa_round_trip": percentiles(joined([run], "round_trip")),
        }
        for run in found["epa"]
    ]
    beside = [
        {
            "bare_lateness": percentiles(joined([run], "lateness")),
            "bare_round_trip": percentiles(joined([run], "round_trip")),
        }
        for run in found["bare"]
    ]
    for turn, latencies in zip(beside, found["cyclictest"], strict=False):
        turn["cyclictest"] = percentiles(latencies)
    return {
        "rig": chosen.rig.name,
        "experiment": chosen.experiment.name,
        "seconds": chosen.seconds,
        "slices": chosen.slices,
        "burn": chosen.burn,
        "core": chosen.core,
        "rights": {
            "sched_fifo": found["fifo"][0],
            "loop": [str(s) for s in found["epa"][0]["granted"]],
            "cores": sleep,
        },
        "epa": epa,
        "bare_pysoem": bare,
        "cyclictest": (
            reference
            or "did not run: it is missing (Debian package rt-tests) or may not SCHED_FIFO"
        ),
        "counts": counts,
        "outcomes": [list(map(str, run["outcome"])) for run in found["epa"]],
        "bare_bad_cycles": sum(
            int(np.count_nonzero(run["counters"] != run["expected"][0])) for run in found["bare"]
        ),
        "ratios": ratios,
        "bar": BAR,
        "runs": by_slice,
        "beside": beside,
    }


def main() -> None:
    arguments = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    arguments.add_argument("--rig", type=Path, default=ROOT / "config/rigs/bench.yaml")
    arguments.add_argument(
        "--experiment",
        type=Path,
        default=ROOT / "config/experiments/identification.yaml",
        help="longer than a slice; stopped at its end",
    )
    arguments.add_argument(
        "--seconds",
        type=float,
        default=60.0,
        help="of the loop, all slices together (default: %(default)s)",
    )
    arguments.add_argument(
        "--slices",
        type=int,
        default=3,
        help="into so many runs the loop's time is cut (default: %(default)s)",
    )
    arguments.add_argument(
        "--beside",
        type=float,
        help="seconds of cyclictest, and of the bare loop (default: as --seconds, at most 120)",
    )
    arguments.add_argument(
        "--burn",
        type=int,
        default=0,
        metavar="N",
        help="so many processes burn the processor all the while",
    )
    arguments.add_argument(
        "--core",
        type=int,
        default=max(os.sched_getaffinity(0)),
        help="of loop, emulator and cyclictest (default: %(default)s)",
    )
    arguments.add_argument(
        "--priority",
        type=int,
        default=80,
        help="SCHED_FIFO of loop and cyclictest; the emulator has one more (default: %(default)s)",
    )
    arguments.add_argument(
        "--sleep",
        action="store_true",
        help="leave the cores' sleep states alone (cyclictest holds them awake by itself)",
    )
    arguments.add_argument("--json", type=Path, help="write the figures here as well")
    arguments.add_argument("--picture", type=Path, help="histograms, one HTML page")
    chosen = arguments.parse_args()
    chosen.beside = chosen.beside or min(chosen.seconds, 120.0)
    raise_limits()
    os.sched_setaffinity(0, {chosen.core})  # emulator and loops inherit it
    with burning(chosen.burn), awake(not chosen.sleep) as sleep:
        found = measure(chosen)
    report = report_of(found, chosen, sleep)
    text = json.dumps(report, indent=2)
    print(text)
    if chosen.json:
        chosen.json.write_text(text + "\n")
    if chosen.picture:
        from bench_bus_picture import draw

        draw(
            report,
            {
                "lateness": {
                    "epa_rt": joined(found["epa"], "lateness"),
                    "bare pysoem": joined(found["bare"], "lateness"),
                    "cyclictest": (
                        np.concatenate(found["cyclictest"]) if found["cyclictest"] else np.zeros(0)
                    ),
                },
                "round trip": {
                    "epa_rt": joined(found["epa"], "round_trip"),
                    "bare pysoem": joined(found["bare"], "round_trip"),
                },
                "cycle time": {
                    "epa_rt": joined(found["epa"], "cycle_time"),
                    "bare pysoem": joined(found["bare"], "cycle_time"),
                },
            },
            chosen.picture,
        )


if __name__ == "__main__":
    main()
