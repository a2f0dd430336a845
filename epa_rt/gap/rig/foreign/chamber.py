"""A sealed chamber whose pressure is watched: what lets it fall or wander.

The link ``pressure`` restarts at every hold; the level it starts from is found in closed form. The
laws take the measured pressure and are integrated over the hold, so that no rate is ever
differentiated. Volume does not stand here: a sealed chamber shows its leak over its volume only, so
leaks count per second.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.rig.foreign.chamber_laws import (
    CRITICAL,
    KAPPA,
    added_pa,
    cooled_pa,
    rate_pa_s,
    run_pa,
)
from epa_rt.gap.rig.foreign.component import Channel, Component, Numbers, Parameter, Setting, effect
from epa_rt.gap.rig.foreign.signals import Signals
from epa_rt.gap.subject import Link

SEARCHED_S, MARGIN_S = (
    20.0,
    0.5,
    # in which the valve shuts; left out after it, or a period of the low-pass, over which it
    # spreads the fill
)
FILLS, FILL_S, SLOWLY, CLIMB_S = (
    0.75,
    30.0,
    0.01,
    0.2,
    # a fill begins below that part of the level it ends at, lasts no longer, and is over where it
    # climbs by less than that part of its steepest, over so long
)
LINK = ("pressure",)


@dataclass(frozen=True)
class Hold:
    """``start`` to ``stop`` in samples; ``seconds`` since the valve shut and ``pressure_pa`` (n,)
    each; ``judged`` (n,).
    """

    start: int
    stop: int
    seconds: np.ndarray
    pressure_pa: np.ndarray
    judged: np.ndarray


@dataclass(frozen=True)
class Prepared:
    signals: Signals
    holds: tuple[Hold, ...]


def prepare(signals: Signals, numbers: Numbers) -> Prepared:
    """Finds the holds: the trials of the log (all of it where it has none), each from the moment
    the pressure starts to fall, after a fill that it holds.

    Times in s, pressures in Pa, low-passed. Rows outside are no longer valid in ``signals``. Raises
    ValueError where ``lowpass`` does.
    """
    pressure, good = signals.columns["pressure"], signals.valid["pressure"]
    smooth = signals.lowpass(pressure)
    trials = [(span.start, span.stop) for span in signals.spans if span.trial] or [
        (0, len(pressure))
    ]
    holds, judged = [], np.zeros(len(pressure), dtype=bool)
    for begin, stop in trials:
        begin += filled(smooth[begin:stop], signals.rate_hz)
        start = (
            begin
            + _shut(smooth[begin:stop], signals.rate_hz)
            + round(max(MARGIN_S, 1.0 / signals.lowpass_hz) * signals.rate_hz)
        )
        if stop - start > 10:
            holds.append(
                Hold(
                    start,
                    stop,
                    np.arange(stop - start) / signals.rate_hz,
                    smooth[start:stop],
                    good[start:stop],
                )
            )
            judged[start:stop] = good[start:stop]
    signals.valid["pressure"] = judged
    return Prepared(signals, tuple(holds))


def filled(pressure: np.ndarray, rate_hz: float) -> int:
    """Sample at which the steepest climb is over, where it is a fill: fast, and from well below the
    level it ends at (what leaks in is slower); 0 where none shows.
    """
    size = max(round(CLIMB_S * rate_hz), 1)
    climb = pressure[size:] - pressure[:-size]
    if not len(climb) or climb.max() <= 0.0:
        return 0
    steepest = int(np.argmax(climb))
    slow = climb < SLOWLY * climb[steepest]
    ends, begun = np.flatnonzero(slow[steepest:]), np.flatnonzero(slow[:steepest])
    if not len(ends):
        return 0
    end, first = steepest + int(ends[0]), int(begun[-1]) if len(begun) else 0
    return (
        end
        if end - first <= FILL_S * rate_hz
        and pressure[: steepest + 1].min() < FILLS * pressure[end]
        else 0
    )


def _shut(pressure: np.ndarray, rate_hz: float) -> int:
    """Sample from which a level turns into a fall, by least squares over a hinge; 0 where none
    shows.
    """
    n = min(len(pressure), round(SEARCHED_S * rate_hz))
    y, time = pressure[:n], np.arange(n) / n
    corners = range(1, n - round(rate_hz), max(1, round(0.1 * rate_hz)))
    best, least = 0, np.inf
    for corner in corners:
        hinge = np.maximum(time - time[corner], 0.0)
        design = np.column_stack([np.ones(n), hinge, hinge**2])
        left = y - design @ np.linalg.lstsq(design, y, rcond=None)[0]
        if left @ left < least:
            best, least = corner, float(left @ left)
    return best


def residual(prepared: Prepared, numbers: Numbers, link: str) -> np.ndarray:
    """(N,) pressure less what the laws take and add since a hold began, Pa, less its mean over the
    hold's judged rows; 0 outside the holds. At the log's rate, unfiltered.
    """
    pressure = prepared.signals.columns["pressure"]
    left = np.zeros(len(pressure))
    for hold in prepared.holds:
        rate = rate_pa_s(hold.pressure_pa, numbers)
        lost = (
            np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]))])
            / prepared.signals.rate_hz
        )
        if numbers["gas.cooling_s"] != 0.0:
            lost = lost + cooled_pa(rate, 1.0 / prepared.signals.rate_hz, numbers)
        part = (
            pressure[hold.start : hold.stop]
            - lost
            - added_pa(hold.seconds, hold.pressure_pa, hold.pressure_pa[0], numbers)
        )
        left[hold.start : hold.stop] = part - part[hold.judged].mean() if hold.judged.any() else 0.0
    return left


def features(prepared: Prepared, link: str) -> Mapping[str, np.ndarray]:
    """(N,) each, at the log's rate: low-passed pressure, Pa, seconds since the hold began, 0
    outside the holds. Raises ValueError where ``lowpass`` does.
    """
    seconds = np.zeros(prepared.signals.samples)
    pressure = prepared.signals.lowpass(prepared.signals.columns["pressure"])
    for hold in prepared.holds:
        seconds[hold.start : hold.stop] = hold.seconds
    return {"pressure_pa": pressure, "hold_time_s": seconds}


def free_run(prepared: Prepared, numbers: Numbers) -> Mapping[str, np.ndarray]:
    """Pressure by forward integration from every hold's first second (Runge-Kutta 4); as measured
    outside the holds.
    """
    pressure = prepared.signals.columns["pressure"].copy()
    step = 1.0 / prepared.signals.rate_hz
    first = max(1, round(prepared.signals.rate_hz))
    for hold in prepared.holds:
        run = run_pa(hold.pressure_pa[0], hold.seconds, step, numbers)
        pressure[hold.start : hold.stop] = (
            run - run[:first].mean() + hold.pressure_pa[:first].mean()
        )
    return {"pressure": pressure}


def _p(
    key: str,
    unit: str,
    of: str | None,
    low: float,
    high: float,
    spread: float,
    scale: str = "",
    neutral: float | None = 0.0,
) -> Parameter:
    return Parameter(key, unit, neutral, low, high, spread, LINK, of, scale)


_ROWS = (
    _p("chamber.stand_leak_per_s", "1/s", None, 0.0, 1.0, 0.2, neutral=None),
    _p("leak.linear_per_s", "1/s", "leak_linear", 0.0, 10.0, 3e-3),
    _p("leak.laminar_per_s", "1/s", "leak_laminar", 0.0, 10.0, 1e-3),
    _p("leak.orifice_per_s", "1/s", "leak_orifice", 0.0, 10.0, 3e-3),
    _p("leak.power_per_s", "1/s", "leak_power", 0.0, 10.0, 3e-3),
    _p("leak.power_ratio", "1", "leak_power", -0.5, 1.0, 0.2, neutral=0.2),
    _p("leak.pressure_opened_per_s", "1/s", "leak_opened", 0.0, 10.0, 3e-3),
    _p("leak.opens_at_pa", "Pa", "leak_opened", 0.0, 1e8, 1e5, neutral=3e5),
    _p("leak.supply_per_s", "1/s", "leak_in", 0.0, 10.0, 1e-3),
    _p("walls.stretch_per_pa", "1/Pa", "wall_stretch", 0.0, 1e-5, 3e-7),
    _p("walls.creep_ratio", "1", "wall_creep", -0.02, 0.02, 2e-3),
    _p("walls.creep_s", "s", "wall_creep", 0.5, 100.0, 5.0, neutral=5.0),
    _p("walls.uptake_ratio", "1", "wall_uptake", -0.05, 0.05, 1e-3),
    _p("gas.heat_ratio", "1", "fill_heat", -0.15, 0.15, 0.01),
    _p("gas.heat_s", "s", "fill_heat", 0.5, 20.0, 3.0, neutral=3.0),
    _p("gas.cooling_s", "s", "gas_cooling", 0.0, 100.0, 3.0),
    _p("gas.ambient_drift_per_s", "1/s", "ambient_drift", -1e-4, 1e-4, 2e-5),
    _p("sensor.drift_pa_s", "Pa/s", "sensor_drift", -100.0, 100.0, 10.0),
    _p("sensor.zero_pa", "Pa", "sensor_zero", -1.5e5, 1.5e5, 3e3),
)


def _leak(
    name: str,
    knobs: tuple[str, ...],
    starts: tuple[tuple[float, ...], ...],
    says: str,
    equation: str,
    source: str,
):
    return effect(name, "leak", "chamber", knobs, starts, says, equation, source)


_EFFECTS = (
    _leak(
        "leak_linear",
        ("leak.linear_per_s",),
        ((3e-3,), (0.1,)),
        "a leak in proportion to the overpressure",
        "dp/dt = -k (p - pa)",
        "permeation, lumped leak",
    ),
    _leak(
        "leak_laminar",
        ("leak.laminar_per_s",),
        ((1e-3,), (0.03,)),
        "a leak through a long fine gap",
        "dp/dt = -k (p^2 - pa^2) / (2 pa)",
        "viscous compressible flow, isothermal",
    ),
    _leak(
        "leak_orifice",
        ("leak.orifice_per_s",),
        ((3e-3,), (0.1,)),
        "a leak through a short hole, choked at high pressure",
        "dp/dt = -k p psi(pa/p)",
        "isentropic nozzle",
    ),
    _leak(
        "leak_opened",
        ("leak.pressure_opened_per_s", "leak.opens_at_pa"),
        ((3e-3, 3e5), (0.1, 3e5)),
        "a leak that opens above a pressure",
        "dp/dt = -k max(p - po, 0)",
        "delamination, relief",
    ),
    _leak(
        "leak_power",
        ("leak.power_per_s", "leak.power_ratio"),
        ((3e-3, 0.2), (0.05, 0.2)),
        "a leak that widens (or narrows) with the overpressure",
        "dp/dt = -k (p - pa) ((p - pa)/pa)^m",
        "compliant cracks, printed walls",
    ),
    effect(
        "leak_in",
        "leak_in",
        "chamber",
        ("leak.supply_per_s",),
        ((1e-3,),),
        "the shut valve lets supply air in",
        "dp/dt = +k (ps - p)",
        "valve seat",
    ),
    effect(
        "wall_stretch",
        "walls",
        "chamber",
        ("walls.stretch_per_pa",),
        ((3e-7,),),
        "walls that stretch: the volume grows with pressure",
        "dp/dt -> dp/dt / (1 + c (2 p - pa))",
        "elastic vessel",
    ),
    effect(
        "wall_creep",
        "relaxation",
        "chamber",
        ("walls.creep_ratio", "walls.creep_s"),
        ((2e-3, 5.0), (2e-3, 50.0)),
        "walls that creep under load",
        "p -> p - b p0 ln(1 + t/t0)",
        "polymer creep",
    ),
    effect(
        "wall_uptake",
        "relaxation",
        "chamber",
        ("walls.uptake_ratio",),
        ((1e-3,), (-1e-3,)),
        "gas that soaks into walls (or out of them)",
        "p -> p - u p0 sqrt(t / 1 s)",
        "Fick's diffusion into a thick wall (Crank 1975)",
    ),
    effect(
        "fill_heat",
        "relaxation",
        "chamber",
        ("gas.heat_ratio", "gas.heat_s"),
        ((0.01, 3.0), (-0.01, 3.0), (0.01, 12.0)),
        "gas that cools (or warms) after the fill; walls that take gas up look the same",
        "p -> p + a p0 exp(-t/T)",
        "heat transfer after a fill",
    ),
    effect(
        "gas_cooling",
        "gas",
        "chamber",
        ("gas.cooling_s",),
        ((3.0,), (10.0,)),
        "gas that cools as it leaks out and warms at the walls",
        "dh/dt = (kappa - 1) dp/dt - h/T, p -> p + h",
        "energy balance of a discharge",
    ),
    effect(
        "ambient_drift",
        "drift",
        "chamber",
        ("gas.ambient_drift_per_s",),
        ((2e-5,), (-2e-5,)),
        "a room that warms or cools",
        "p -> p (1 + a t)",
        "ideal gas",
    ),
    effect(
        "sensor_drift",
        "drift",
        "chamber",
        ("sensor.drift_pa_s",),
        ((10.0,), (-10.0,)),
        "a pressure sensor that drifts",
        "p_read -> p_read + d t",
        "sensor data sheets",
    ),
    effect(
        "sensor_zero",
        "sensor",
        "chamber",
        ("sensor.zero_pa",),
        ((3e3,), (-3e3,), (-1e5,), (1e5,)),
        "a pressure sensor with a wrong zero; about -1 bar: it reads gauge, not absolute",
        "p = p_read - z",
        "calibration",
    ),
)

EQUATIONS = (
    (
        f"a fill within a trial is the steepest climb over {CLIMB_S:g} s of the low-passed"
        f" pressure, if it begins below {FILLS:g} of where it ends and lasts at most {FILL_S:g} s;"
        f" it ends where it climbs by less than {SLOWLY:g} of its steepest, and the trial begins"
        " there"
    ),
    (
        f"a hold begins {MARGIN_S:g} s (a period of the low-pass, where that is longer) after the"
        " corner of the level and parabola that fit the low-passed pressure of its first"
        f" {SEARCHED_S:g} s best; t counts from there, p0 is the pressure there"
    ),
    (
        "dp/dt = (sum of the leaks) / (1 + c max(2 p - pa, 0)), p less the gauge's zero,"
        " overpressures never below 0, stand and linear leak k (p - pa)"
    ),
    (
        f"psi(r) = sqrt(r^(2/kappa) - r^((kappa + 1)/kappa)) over its value at {CRITICAL:g}, r no"
        f" less than that, kappa = {KAPPA:g}"
    ),
    (
        "lost(t) = integral of dp/dt at the measured, low-passed pressure by trapezes; with cooling"
        " lost + h, dh/dt = (kappa - 1) dp/dt - h/T, exact for a rate held over a row"
    ),
    (
        "residual = p_read - lost - added - its mean over the hold, low-passed and thinned out;"
        " added = drift d t + room a t p + heat a p0 exp(-t/T) - creep b p0 ln(1 + t/t0) -"
        " uptake u p0 sqrt(t / 1 s)"
    ),
    (
        "free run: dp/dt and h from p0 on by Runge and Kutta's fourth order, a step a row, the same"
        " terms added, its first second laid on the log's"
    ),
)

COMPONENT = Component(
    kind="chamber",
    says="a sealed chamber: pressure over time",
    channels=(Channel("pressure", "Pa", "absolute pressure of the chamber", size="supply"),),
    settings=(
        Setting("atmosphere", "Pa", 1e3, 1e6, 101_325.0, "absolute pressure around it"),
        Setting("supply", "Pa", 1e3, 1e8, 1e6, "absolute pressure behind the shut valve"),
    ),
    links=(
        (
            Link(
                "pressure",
                "chamber",
                "chamber_pressure_pa",
                "Pa",
                "time since the valve shut to pressure",
            ),
            "pressure",
        ),
    ),
    parameters=_ROWS,
    effects=_EFFECTS,
    prepare=prepare,
    residual=residual,
    features=features,
    free_run=free_run,
    equations=EQUATIONS,
)
