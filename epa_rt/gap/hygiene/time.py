"""Cycles and clock of a log: lost and repeated cycles, steps and drift of the stamps, the sampling
period.
"""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.finding import Finding, seconds
from epa_rt.gap.recording import Recording

_MOST_LOST = 0.2  # share of lost cycles above which the rest is no experiment any more
LEAST_ROWS = 50  # a filter of fourth order that runs both ways needs 16
_STEP = 0.5  # of a period: a stamp off by more is no jitter
_MOST_STEPS = 0.01  # share of cycles with such a step above which the clock is no clock
_DRIFT = 1e-3  # clocks of two computers differ by up to 1e-4
_PERIOD_OFF = 0.01
_BESIDE_S = 0.05  # taken out on both sides of a step


def check_time(recording: Recording, rig: Rig | None) -> list[Finding]:
    """Findings on cycle numbers and stamps."""
    found = []
    if recording.samples < LEAST_ROWS:
        return [
            _of(
                recording,
                "refuse",
                "too short",
                f"found {recording.samples} rows, expected an experiment of {LEAST_ROWS} or more",
            )
        ]
    if rig is not None and abs(recording.period_s / rig.period_s - 1.0) > 1e-6:
        found.append(
            _of(
                recording,
                "refuse",
                "period",
                f"found a sampling period of {recording.period_s * 1e3:g} ms, expected"
                f" {rig.period_s * 1e3:g} ms, the rig's: a row a cycle (rows that were never"
                " recorded are not made up)",
            )
        )
    found += _cycles(recording)
    if recording.t_ns is not None and not any(f.severity == "refuse" for f in found):
        found += _clock(recording)
    return found


def _of(recording: Recording, severity: str, kind: str, sentence: str, rows: tuple = ()) -> Finding:
    return Finding(severity, kind, recording.name, "", f"{recording.name}: {sentence}", rows)


def _cycles(recording: Recording) -> list[Finding]:
    steps = np.diff(recording.cycle)
    found = []
    if np.any(steps < 0):
        row = int(np.argmax(steps < 0)) + 1
        return [
            _of(
                recording,
                "refuse",
                "cycles go back",
                f"found cycle {recording.cycle[row]} after cycle {recording.cycle[row - 1]} "
                f"at {seconds(recording, row - 1):.3f} s, expected cycles in order",
            )
        ]
    again = np.flatnonzero(steps == 0) + 1
    if len(again):
        found.append(
            _of(
                recording,
                "exclude",
                "repeated cycles",
                f"found {len(again)} cycles twice, the first cycle {recording.cycle[again[0]]} at"
                f" {seconds(recording, again[0]):.3f} s, expected each once; the second ones are"
                " left out",
                tuple((int(r), int(r) + 1) for r in again),
            )
        )
    lost = int(np.clip(steps - 1, 0, None).sum())
    if lost:
        gaps = np.flatnonzero(steps > 1)
        share = lost / (lost + recording.samples - len(again))
        severity = "refuse" if share > _MOST_LOST else "exclude"
        found.append(
            _of(
                recording,
                severity,
                "lost cycles",
                f"found {lost} lost cycles ({share:.2%}) in {len(gaps)} gaps, the first at"
                f" {seconds(recording, int(gaps[0])):.3f} s, the longest"
                f" {(steps.max() - 1) * recording.period_s * 1e3:g} ms; expected none; nothing is"
                " put in their place",
            )
        )
    return found


def _clock(recording: Recording) -> list[Finding]:
    """Stamps against cycle numbers."""
    period_ns = recording.period_s * 1e9
    cycles = np.diff(recording.cycle)
    once = cycles > 0
    off = (np.diff(recording.t_ns) - cycles * period_ns)[once] / period_ns
    rows = np.flatnonzero(once) + 1
    calm = np.where(np.abs(off) > _STEP, 0.0, off)
    drift = float(calm.sum() / max(cycles.sum(), 1))  # stamps that are rounded balance in the sum
    typical = float(np.median(off / cycles[once]))
    typical = typical if abs(typical) > _STEP else drift
    if abs(typical) > _PERIOD_OFF:
        return [
            _of(
                recording,
                "refuse",
                "period",
                f"found stamps {(1 + typical) * recording.period_s * 1e3:.4g} ms apart from cycle"
                f" to cycle, expected {recording.period_s * 1e3:g} ms",
            )
        ]
    steps = np.flatnonzero(np.abs(off) > _STEP)
    found = []
    if len(steps) > max(_MOST_STEPS * len(off), 3):
        return [
            _of(
                recording,
                "refuse",
                "clock",
                f"found {len(steps)} stamps off by more than half a period, by"
                f" {np.abs(off).max() * recording.period_s * 1e3:.3g} ms at most, expected stamps"
                " at a steady rate",
            )
        ]
    if len(steps):
        beside = max(round(_BESIDE_S / recording.period_s), 1)
        first = int(steps[0])
        where = tuple(
            (max(int(rows[s]) - beside, 0), min(int(rows[s]) + beside, recording.samples))
            for s in steps
        )
        found.append(
            _of(
                recording,
                "exclude",
                "clock step",
                f"found {len(steps)} step{'s' * (len(steps) > 1)} of the clock, the first of"
                f" {off[first] * recording.period_s * 1e3:+.3g} ms at cycle"
                f" {recording.cycle[rows[first]]} ({seconds(recording, int(rows[first])):.3f} s),"
                f" expected one period from stamp to stamp; {_BESIDE_S * 1e3:g} ms on both sides"
                " are left out",
                where,
            )
        )
    if abs(drift) > _DRIFT:
        found.append(
            _of(
                recording,
                "refuse",
                "clock drift",
                f"found a clock that drifts by {drift:+.2%} against the cycles, expected less than"
                f" {_DRIFT:.1%}",
            )
        )
    return found
