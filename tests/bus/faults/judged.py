"""From the trace of a plant and the log of a run to facts: when was it safe, who noticed, does the
log lack anything.
"""

from pathlib import Path

from epa_rt.logs.layout import FLAG_OVERRUN, FLAG_WORKING_COUNTER_OK
from epa_rt.logs.reader import LogReader
from tests.bus.faults.scenarios import Scenario
from tests.bus.faults.traced import Row


def is_safe(row: Row, stuck: tuple[str, ...] = ()) -> bool:
    """Torque off, inlets shut, exhausts open; valves named in ``stuck`` ("inlet", "exhaust", "inlet
    of 1") cannot obey.
    """
    inlets = [
        is_open
        for n, is_open in enumerate(row.inlet_open)
        if not {"inlet", f"inlet of {n}"} & set(stuck) or n and "inlet" in stuck
    ]
    exhausts = [
        is_open for n, is_open in enumerate(row.exhaust_open) if n or "exhaust" not in stuck
    ]
    return not row.enabled and not any(inlets) and all(exhausts)


def first_safe(rows: list[Row], stuck: tuple[str, ...]) -> int | None:
    """The cycle from which on all rows are safe; None where the last one is not."""
    since = None
    for row in reversed(rows):
        if not is_safe(row, stuck):
            break
        since = row.cycle
    return since


def largest_step(rows: list[Row]) -> float:
    """Largest change of the motor's speed from one cycle to the next, rad/s."""
    return max(
        (abs(b.speed_rad_s - a.speed_rad_s) for a, b in zip(rows, rows[1:], strict=False)),
        default=0.0,
    )


def facts_of(
    scenario: Scenario,
    code: int,
    said: str,
    log: Path,
    rows: list[Row],
    injected_at: int | None,
    last_frame_cycle: int,
) -> dict:
    """What a test or the table wants to know; JSON."""
    assert log.exists(), said
    with LogReader(log) as reader:
        missing, ending, events = reader.missing, reader.ending, reader.events()
        cycle = reader.columns("/cycle", ["cycle", "flags"])
    bad = [
        int(c)
        for c, flags in zip(cycle["cycle"], cycle["flags"], strict=False)
        if not flags & FLAG_WORKING_COUNTER_OK
    ]
    trip = next((event for event in events if event.kind in ("trip", "error")), None)
    noticed = (
        None if trip is None or scenario.real_time else trip.cycle + (trip.kind == "error")
    )  # an error belongs to the cycle after the last good one
    safe = first_safe(rows, scenario.stuck)
    torque_off = next(
        (
            row.cycle
            for row in rows
            if injected_at is not None and row.cycle >= injected_at and not row.enabled
        ),
        None,
    )
    after = [row for row in rows if injected_at is not None and row.cycle >= injected_at]
    around = [
        row
        for row in rows
        if injected_at is not None and injected_at - 5 <= row.cycle < injected_at + 400
    ]
    return {
        "code": code,
        "said": said,
        "sentence": said.splitlines()[0] if said else "",
        "missing": missing,
        "outcome": ending.outcome,
        "cause": ending.cause,
        "cycles": len(cycle["cycle"]),
        "injected_at": injected_at,
        "safe_at": safe,
        "torque_off_at": torque_off,
        "noticed_at": noticed,
        "bad": bad,
        "last_frame_cycle": last_frame_cycle,
        "overruns": sum(1 for flags in cycle["flags"] if flags & FLAG_OVERRUN),
        "safe_in": cycles_between(injected_at, safe),
        "noticed_in": cycles_between(injected_at, noticed),
        "was_moving": bool(after) and abs(after[0].speed_rad_s) > 1.0,
        "highest_pa": max((row.pressure_pa for row in after), default=0.0),
        "highest_force_n": max((row.force_n for row in after), default=0.0),
        "travel_range_m": [f(row.travel_m for row in after) for f in (min, max)] if after else [],
        "largest_step_rad_s": largest_step(around),
        "usual_step_rad_s": largest_step(
            [row for row in rows if injected_at is None or row.cycle < injected_at]
        ),
        "residual_torque_nm": max(
            (abs(row.torque_nm) for row in rows if safe is not None and row.cycle >= safe + 3),
            default=0.0,
        ),
        "events": [
            [event.cycle, event.kind, event.text]
            for event in events
            if event.kind not in ("switch", "phase", "state", "realtime")
        ],
    }


def cycles_between(first: int | None, last: int | None) -> int | None:
    return None if first is None or last is None else last - first
