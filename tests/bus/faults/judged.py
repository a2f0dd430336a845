"""From the trace of a plant and the log of a run to facts: what the rig went through, who noticed,
does the log lack anything.
"""

from collections.abc import Callable
from pathlib import Path

from epa_rt.config.rig import Rig
from epa_rt.logs.layout import FLAG_WORKING_COUNTER_OK
from epa_rt.logs.reader import LogReader
from epa_rt.models.plant_file import load_plant
from sim_backend.drive_machine import ENABLED, QUICK_STOP
from tests.bus.faults.scenarios import Scenario
from tests.bus.faults.traced import Row
from tests.faults.trial import STANDS_M_S


def air_goes_out(row: Row, stuck: tuple[str, ...] = ()) -> bool:
    """Inlets shut, exhausts open; valves named in ``stuck`` ("inlet", "exhaust", "inlet of 1")
    cannot obey.
    """
    inlets = [
        is_open
        for n, is_open in enumerate(row.inlet_open)
        if not {"inlet", f"inlet of {n}"} & set(stuck) or n and "inlet" in stuck
    ]
    exhausts = [
        is_open for n, is_open in enumerate(row.exhaust_open) if n or "exhaust" not in stuck
    ]
    return not any(inlets) and all(exhausts)


def since(rows: list[Row], holds: Callable[[Row], bool]) -> int | None:
    """The cycle from which on it holds in all rows; None where it does not in the last one."""
    found = None
    for row in reversed(rows):
        if not holds(row):
            break
        found = row.cycle
    return found


def rig_facts(rows: list[Row], rig: Rig, stuck: tuple[str, ...] = ()) -> dict:
    """What the rig went through in rows that begin with a fault; cycles and SI, None for never.

    ``power_gone_at``: no power from then on. ``power_never_left``: before that. ``beyond``: what of
    the motor went outside its limits while it had power.
    """
    gone = since(rows, lambda row: not row.powered)
    at_power_off = next((row for row in rows if row.cycle == gone), None)
    before = [row for row in rows if gone is None or row.cycle < gone]
    low_m, high_m = rig.row(rig.motor.position).limits
    most_m_s = rig.row(rig.motor.speed).limits[1]
    return {
        "air_out_at": since(rows, lambda row: air_goes_out(row, stuck)),
        "stopping_at": next((row.cycle for row in rows if row.drive_state != ENABLED), None),
        "power_gone_at": gone,
        "power_never_left": all(row.powered for row in before),
        "holds_at_end": rows[-1].powered and rows[-1].drive_state == QUICK_STOP,
        "speed_at_power_off_m_s": abs(at_power_off.speed_m_s) if at_power_off else None,
        "stops_m": _stops_m(rig),
        "vented_pa": rig.safety.sensors.vented,
        "gauge_at_power_off_pa": gauge_pa(at_power_off, rig) if at_power_off else None,
        "rest_at": since(rows, lambda row: abs(row.speed_m_s) < STANDS_M_S),
        "vented_at": since(rows, lambda row: gauge_pa(row, rig) < rig.safety.sensors.vented),
        "travel_range_m": [f(row.travel_m for row in rows) for f in (min, max)],
        "fastest_m_s": max(abs(row.speed_m_s) for row in rows),
        "highest_pa": max(max(row.pressure_pa) for row in rows),
        "beyond": [
            *(["travel"] if not all(low_m <= row.travel_m <= high_m for row in before) else []),
            *(["speed"] if not all(abs(row.speed_m_s) <= most_m_s for row in before) else []),
        ],
        "residual_torque_nm": max(
            (abs(row.torque_nm) for row in rows if gone is not None and row.cycle >= gone + 3),
            default=0.0,
        ),
    }


def _stops_m(rig: Rig) -> list[float]:
    """Travel of the drive train's end stops, of the plant."""
    transmission = load_plant(Path("config/plants") / Path(rig.plant).name).params["transmission"][
        0
    ]
    return [float(transmission["low_stop_m"]), float(transmission["high_stop_m"])]


def gauge_pa(row: Row, rig: Rig) -> float:
    """Of the muscle that holds most."""
    return max(row.pressure_pa) - rig.atmosphere_pa


def facts_of(
    scenario: Scenario,
    rig: Rig,
    code: int,
    said: str,
    log: Path,
    rows: list[Row],
    injected_at: int | None,
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
    after = [row for row in rows if injected_at is not None and row.cycle >= injected_at]
    return {
        "code": code,
        "said": said,
        "sentence": next((s for s in said.splitlines() if not s.startswith("UNPROTECTED")), ""),
        "missing": missing,
        "outcome": ending.outcome,
        "cause": ending.cause,
        "injected_at": injected_at,
        "noticed_at": noticed,
        "noticed_in": None if None in (injected_at, noticed) else noticed - injected_at,
        "bad": bad,
        "had_power": any(row.powered for row in after),
        "was_moving": bool(after) and abs(after[0].speed_rad_s) > 1.0,
        **(rig_facts(after, rig, scenario.stuck) if after else {}),
        "events": [
            [event.cycle, event.kind, event.text]
            for event in events
            if event.kind not in ("switch", "phase", "state", "realtime")
        ],
    }
