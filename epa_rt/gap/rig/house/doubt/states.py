"""States that errors hang on, each in units of one, and what they make: directions, waves,
memories, relaxations.

Where a link's own reading is such a state, the modelled one stands for it: its noise must not
explain itself.
"""

import numpy as np

from epa_rt.gap.likelihood.stop_operator import stop_over_log
from epa_rt.gap.rig.house import motor_link, smooth
from epa_rt.gap.rig.house.evaluate import Bench
from epa_rt.gap.rig.house.states import slow

TRAVEL_M, PRESSURE_PA, FORCE_N, CURRENT_A = 0.02, 3e5, 100.0, 1.0  # of a state that counts as one
SPEED_M_S, MOTOR_RAD_S, PLACE_RAD_S, MINUTE_S = 0.05, 100.0, 1.0, 60.0
CREEPING = 0.1  # of a speed, below which direction fades

Shapes = list[np.ndarray]


def way(speed: np.ndarray) -> np.ndarray:
    """Direction of a speed in parts of its own one."""
    return np.tanh(speed / CREEPING)


def waves(angle: np.ndarray, counts: tuple[int, ...]) -> Shapes:
    return [f(k * angle) for k in counts for f in (np.sin, np.cos)]


def memories(place: np.ndarray, widths: tuple[float, ...]) -> Shapes:
    return [stop_over_log(np.ascontiguousarray(place), half) / half for half in widths]


def fading(x: np.ndarray, period_s: float, times_s: tuple[float, ...]) -> Shapes:
    """What relaxes of a change, over each of these times."""
    return [x - x[0] - slow(x - x[0], period_s, time_s) for time_s in times_s]


def minutes(bench: Bench) -> np.ndarray:
    return np.arange(bench.prepared.count) * bench.prepared.period_s / MINUTE_S


def has_gauge(bench: Bench, i: int) -> bool:
    """Whether a muscle is there and its pressure is measured."""
    return (
        bool(bench.params["muscle"]["present"][0, i] > 0.5)
        and f"muscle{i}_gauge_pa" in bench.prepared.readings
    )


def modelled_gauge(bench: Bench, i: int) -> np.ndarray:
    """(N,) gauge pressure that the gas should have, in parts of PRESSURE_PA."""
    return (bench.pressure(i)[0] - float(bench.params["gas"]["atmosphere_pa"][0, i])) / PRESSURE_PA


def line_of(bench: Bench, i: int) -> tuple[np.ndarray, np.ndarray]:
    """Length of a line past that at no travel, and its speed."""
    line = bench.line(i)
    return (line[0] - float(bench.params["load"][f"rest{i}_m"][0])) / TRAVEL_M, line[1] / SPEED_M_S


def calm_force(bench: Bench, i: int) -> np.ndarray:
    """(N,) force from length and measured pressure, smoothed, in parts of FORCE_N: its noise is not
    the force cell's.
    """
    return bench.predicted_force(i, calm=True) / FORCE_N


def spool_force(bench: Bench) -> np.ndarray:
    """(N,) force at the spool, in parts of FORCE_N; zeros where nothing measured says it."""
    known = "force_n" in bench.prepared.readings or has_gauge(bench, 0)
    both = (
        bench.params["load"]["travel1_ratio"][0] == 0.0
        or bench.params["muscle"]["present"][0, 1] < 0.5
        or has_gauge(bench, 1)
    )
    return bench.spool() / FORCE_N if known and both else bench.zero()


def spool_turn(bench: Bench) -> np.ndarray:
    """(N,) rad of the spool."""
    return bench.motor()[0] / float(bench.params["transmission"]["gear_ratio"][0])


def modelled_current(bench: Bench) -> np.ndarray:
    """(N,) current that the motion should take."""
    out = np.empty(bench.prepared.count)
    motor_link.balance_current(
        bench.params,
        *bench.motor(),
        FORCE_N * spool_force(bench),
        bench.warmth(),
        bench.prepared.period_s,
        out,
    )
    return smooth.flat_smoothed(out, smooth.gaussian_taps(smooth.SLOPE_CYCLES)) / CURRENT_A
