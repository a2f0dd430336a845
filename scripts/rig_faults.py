"""Writes docs/faults.md: what a fault does to the rig itself, at four moments, on four rigs.

python scripts/rig_faults.py                      all of them, on two processes
python scripts/rig_faults.py --rigs bench --faults sto --json     a few, as JSON
python scripts/rig_faults.py --no-bus             without the faults of the bus
"""

import argparse
import json
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from epa_rt.config.rig import Rig, load_rig
from tests.faults.moments import MOMENTS
from tests.faults.trial import CTRL_C, CTRL_C_TWICE, Fault, Figures, run_trial

PAGE = ROOT / "docs" / "faults.md"
RIGS = ("bench", "bench_analog", "knee", "mass")
BUS_KINDS = ("cable_pulled", "frames_lost", "two_of_three_lost", "slave_lost", "slave_falls")
OUTCOMES = ("completed", "stopped", "tripped", "failed")
CALM_M_S = 0.005  # slower than this when power goes is at rest

HEAD = """# Faults

To look up what each fault does to the rig itself: how fast and how far it goes, when it is at
rest and vented. Written by `python scripts/rig_faults.py`. Each fault comes at one of four moments
of a run: at rest under pressure, at speed, at full stretch, while a muscle is filled. Plant faults
run on the simulated rig, faults of the bus (in *italics*) through pysoem on the emulated one, in
lock step. The figures are the plant's own, from the fault until eight seconds after the run.

Category 1: drive, bus and position are sound; the drive brakes, holds while the muscles vent, and
power goes at rest. Category 0: one of them is lost; power off and air out at once. A bold figure
is outside the rig file's limits. How each fault of the bus is noticed, and after how many cycles:
[bus-faults.md](bus-faults.md). What no sensor shows: [sensors.md](sensors.md).

Exit codes: 0 the run went on; 3 tripped; 4 bus lost; plus 10 drive not measured to be off, 20 not
vented, 40 not at rest.
"""
COLUMNS = (
    "Fault",
    "Moment",
    "Stop",
    "Fastest, mm/s",
    "Travel, mm",
    "Highest, kPa gauge",
    "Power off, s",
    "Then, mm/s",
    "Rest, s",
    "Vented, s",
    "Exit",
    "Cause",
)


class Case(NamedTuple):
    """One run."""

    rig: str
    fault: Fault
    moment: str


class Limits(NamedTuple):
    """What the rig file allows; m/s, m, Pa."""

    speed_m_s: float
    low_m: float
    high_m: float
    pressure_pa: float


def limits_of(rig: Rig) -> Limits:
    """From the limits of the rows."""
    speed, travel = rig.row(rig.motor.speed).limits, rig.row(rig.motor.position).limits
    pressure = min(rig.row(muscle.pressure).limits[1] for muscle in rig.muscles)
    return Limits(max(map(abs, speed)), *travel, pressure)


def plant_faults(rig: Rig) -> Iterator[Fault]:
    """Everything that can break behind the terminals, and what an operator does."""
    muscle = rig.muscles[0]
    force = next((row.name for row in rig.inputs if row.si_unit == "N"), None)
    joint = rig.joint.position if rig.joint else None
    for row in filter(None, (muscle.pressure, force, joint)):
        yield Fault("wire_broken", row)
        yield Fault("sensor_stuck", row)
    yield Fault("sensor_stuck", rig.motor.position)
    yield Fault("sensor_stuck", rig.motor.speed)
    yield Fault("sensor_stuck", rig.motor.current)
    yield Fault("sensor_gain", muscle.pressure, 0.5)
    yield Fault("toggle_frozen", "analog_in")
    for row in (muscle.inlet, muscle.exhaust):
        yield Fault("valve_stuck_open", row)
        yield Fault("valve_stuck_closed", row)
    yield Fault("leak", muscle.name, 5.0)
    yield Fault("burst", muscle.name)
    yield Fault("supply_lost")
    yield Fault("encoder_jump")
    for kind in ("drive_fault", "following_error", "sto", "drive_supply_lost"):
        yield Fault(kind)
    yield Fault(CTRL_C)
    yield Fault(CTRL_C_TWICE)


def bus_faults(rig: Rig) -> Iterator[Fault]:
    """What can break between master and terminals."""
    yield Fault("cable_pulled")
    yield Fault("frames_lost", "", 3)
    yield Fault("two_of_three_lost")
    for slave in rig.slaves[1:]:
        yield Fault("slave_lost", slave.name)
        yield Fault("slave_falls", slave.name)


def run_case(case: Case) -> Figures:
    """Where the fault belongs: simulation or bus."""
    if case.fault.kind in BUS_KINDS:
        from tests.faults.on_bus import run_on_bus

        return run_on_bus(*case)
    return run_trial(*case)


def category_of(figures: Figures) -> str:
    """1, 0 or a dash where nothing tripped."""
    return figures.category[len("stop category ")] if figures.category else "–"


def outside(figures: Figures, limits: Limits) -> list[str]:
    """Which of speed, travel and pressure left the rig file's limits."""
    found = []
    if figures.fastest_m_s > limits.speed_m_s:
        found.append("speed")
    if figures.lowest_m < limits.low_m or figures.highest_m > limits.high_m:
        found.append("travel")
    if figures.highest_pa > limits.pressure_pa:
        found.append("pressure")
    return found


def row_of(case: Case, figures: Figures, limits: Limits, atmosphere_pa: float) -> str:
    """A line of the table."""
    if not figures.injected:
        return f"| {case.fault} | {case.moment} | the moment did not come |" + " |" * 9
    out = outside(figures, limits)
    fastest = _bold(f"{1e3 * figures.fastest_m_s:.0f}", "speed" in out)
    travel = f"{1e3 * figures.lowest_m:.1f} to {1e3 * figures.highest_m:.1f}"
    pressure = f"{1e-3 * (figures.highest_pa - atmosphere_pa):.0f}"
    name = f"*{case.fault}*" if case.fault.kind in BUS_KINDS else str(case.fault)
    cells = (
        name,
        case.moment,
        category_of(figures),
        fastest,
        _bold(travel, "travel" in out),
        _bold(pressure, "pressure" in out),
        _seconds(figures.power_off_s),
        f"{1e3 * figures.speed_at_power_off_m_s:.0f}" if figures.power_off_s is not None else "–",
        _seconds(figures.rest_s),
        _seconds(figures.vented_s),
        str(figures.code),
        cause_of(figures),
    )
    return "| " + " | ".join(cells) + " |"


def cause_of(figures: Figures) -> str:
    """The words between outcome and details."""
    lines = figures.said.splitlines()
    words = next((line for line in lines if line.startswith(OUTCOMES)), lines[0]).split(": ")
    return ": ".join(words[:2])[:60].replace("|", "/")


def _bold(text: str, yes: bool) -> str:
    return f"**{text}**" if yes else text


def _seconds(value: float | None) -> str:
    return "never" if value is None else f"{value:.2f}"


def summary_of(found: dict[Case, Figures], limits: dict[str, Limits]) -> str:
    """What the whole comes to, in figures."""
    came = {case: figures for case, figures in found.items() if figures.injected}
    first = {case: f for case, f in came.items() if category_of(f) == "1"}
    left = [case for case, f in first.items() if outside(f, limits[case.rig])]
    fast = [case for case, f in first.items() if f.speed_at_power_off_m_s > CALM_M_S]
    zero = {case: f for case, f in came.items() if category_of(f) == "0"}
    lines = [
        f"{len(found)} runs, in {len(came)} the moment came. {len(first)} stopped by category 1, of"
        f" which {len(left)} left a limit and {len(fast)} moved when power went.",
        f"{len(zero)} stopped by category 0, {len(came) - len(first) - len(zero)} without a trip.",
    ]
    if left or fast:
        lines.append("Category 1 outside a limit, or moving when power went:")
        lines += [f"- {case.rig}, {case.fault}, {case.moment}" for case in {*left, *fast}]
    for rig in limits:
        worst = [f for case, f in zero.items() if case.rig == rig]
        if worst:
            lines.append(
                f"- {rig}, category 0: at most {1e3 * max(f.fastest_m_s for f in worst):.0f} mm/s,"
                f" {1e3 * min(f.lowest_m for f in worst):.0f} to"
                f" {1e3 * max(f.highest_m for f in worst):.0f} mm"
            )
    return "\n".join(lines) + "\n"


def page(found: dict[Case, Figures]) -> str:
    """The whole page."""
    rigs = {name: load_rig(ROOT / f"config/rigs/{name}.yaml") for name in RIGS}
    limits = {name: limits_of(rig) for name, rig in rigs.items()}
    parts = [HEAD, "## In figures\n", summary_of(found, limits)]
    for name, rig in rigs.items():
        rows = [
            row_of(case, figures, limits[name], rig.atmosphere_pa)
            for case, figures in found.items()
            if case.rig == name
        ]
        if not rows:
            continue
        low, high = 1e3 * limits[name].low_m, 1e3 * limits[name].high_m
        most_kpa = 1e-3 * (limits[name].pressure_pa - rig.atmosphere_pa)
        parts += [
            f"## {name}\n",
            f"Limits: {1e3 * limits[name].speed_m_s:.0f} mm/s, {low:.0f} to {high:.0f} mm,"
            f" {most_kpa:.0f} kPa gauge.\n",
            f"| {' | '.join(COLUMNS)} |",
            f"|{'---|' * len(COLUMNS)}",
            *rows,
            "",
        ]
    return "\n".join(parts)


def cases_of(rigs: list[str], kinds: list[str], with_bus: bool) -> list[Case]:
    """All runs that were asked for."""
    cases = []
    for name in rigs:
        rig = load_rig(ROOT / f"config/rigs/{name}.yaml")
        faults = [*plant_faults(rig), *(bus_faults(rig) if with_bus else ())]
        cases += [
            Case(name, fault, moment)
            for fault in faults
            if not kinds or fault.kind in kinds
            for moment in MOMENTS
        ]
    return cases


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rigs", nargs="+", choices=RIGS, default=list(RIGS))
    parser.add_argument("--faults", nargs="+", default=[], help="kinds of fault (default: all)")
    parser.add_argument("--no-bus", action="store_true")
    parser.add_argument("--json", action="store_true", help="figures as JSON; no page is written")
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    cases = cases_of(arguments.rigs, arguments.faults, not arguments.no_bus)
    found = {}
    with ProcessPoolExecutor(arguments.processes) as pool:
        for case, figures in zip(cases, pool.map(run_case, cases), strict=True):
            found[case] = figures
            print(
                f"{len(found)}/{len(cases)} {case.rig}: {case.fault}, {case.moment}",
                file=sys.stderr,
            )
    if arguments.json:
        rows = [
            {"rig": case.rig, "fault": str(case.fault), "moment": case.moment, **figures._asdict()}
            for case, figures in found.items()
        ]
        print(json.dumps(rows, indent=1))
    else:
        PAGE.write_text(page(found), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
