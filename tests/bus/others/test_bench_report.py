"""The bus benchmark's arithmetic on made-up runs: what counts as accounted for, ratios, the page.
No clock, no bus.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.bus.others.places import ROOT

sys.path.insert(0, str(ROOT / "scripts"))
import bench_bus
import bench_bus_picture

N, PERIOD_NS = 1000, 1_000_000


def made_up(late_at=(), lateness_ns=20_000, trip_ns=80_000, **changed):
    """A run of N cycles with two edges missed behind each cycle of ``late_at``."""
    lateness = np.full(N, lateness_ns, np.int64)
    edges = np.arange(N, dtype=np.int64) * PERIOD_NS
    for i in late_at:
        lateness[i] = 2 * PERIOD_NS + 400_000
        edges[i + 1 :] += 2 * PERIOD_NS
    counts = {
        "cycles": N,
        "recorded": N,
        "lost_samples": 0,
        "duplicated": 0,
        "overruns_counted": len(late_at),
        "overruns_flagged": len(late_at),
        "overruns_late": len(late_at),
        "edges_missed": 2 * len(late_at),
        "bad_cycles": 0,
        "log_whole": True,
    } | changed
    return {
        "woken_ns": edges + lateness,
        "lateness_ns": lateness,
        "round_trip_ns": np.full(N, trip_ns),
        "busy_ns": np.full(N, 30_000),
        "granted": ["ordinary"],
        "outcome": ["stopped", ""],
        "counters": np.full(N, 8),
        "expected": np.array([8]),
        **{name: np.array([value]) for name, value in counts.items()},
    }


CHOSEN = argparse.Namespace(
    rig=Path("bench.yaml"),
    experiment=Path("identification.yaml"),
    seconds=1.0,
    slices=1,
    burn=0,
    core=1,
)


def report(*runs, reference=True):
    found = {
        "epa": list(runs),
        "bare": [made_up(trip_ns=40_000)],
        "cyclictest": [np.full(N, 10.5)] if reference else [],
        "fifo": [False],
    }
    return bench_bus.report_of(found, CHOSEN, "as they are")


def test_ratios_are_ours_over_theirs():
    ratios = report(made_up())["ratios"]
    assert ratios["round_trip_median_over_bare"] == 2.0
    assert ratios["lateness_p99_9_over_cyclictest"] == pytest.approx(20.0 / 10.5, abs=1e-3)
    assert set(report(made_up(), reference=False)["ratios"]) == {"round_trip_median_over_bare"}


def test_late_cycles_that_the_log_shows_are_accounted_for():
    counts = report(made_up(late_at=(100, 500)), made_up())["counts"]
    assert (
        counts["cycles"],
        counts["edges_missed"],
        counts["edges_missed_by_lateness"],
        counts["accounted"],
    ) == (2 * N, 4, 4, True)


@pytest.mark.parametrize(
    "changed",
    [
        {"lost_samples": 1},
        {"duplicated": 1},
        {"overruns_flagged": 1},
        {"overruns_counted": 3},
        {"edges_missed": 5},
        {"log_whole": False},
    ],
)
def test_what_does_not_add_up_is_not_accounted_for(changed):
    assert report(made_up(late_at=(100, 500), **changed))["counts"]["accounted"] is False


def test_the_page_shows_ratios_and_all_three(tmp_path):
    path = tmp_path / "page.html"
    series = {
        "lateness": {
            "epa_rt": np.full(N, 20.0),
            "bare pysoem": np.full(N, 19.0),
            "cyclictest": np.zeros(0),
        },
        "cycle time": {"epa_rt": np.full(N, 1001.0)},
    }
    bench_bus_picture.draw(report(made_up()), series, path)
    text = path.read_text("utf-8")
    assert (
        "bar 1.3" in text
        and "Wake-up lateness" in text
        and "p99.9 over cyclictest" in text
        and "all accounted for" in text
    )
