"""How fast and how exact the compiled plant is, beside scipy's solve_ivp on the same physics.
Prints JSON.

Per plant: time per 1 ms cycle and times real time (median and best of several runs over a whole log
in one call, noise on), the largest error of every sensor over the log against 32 times finer
sub-steps (noise off, in sensor steps), and the ratio to solve_ivp (noise off on both sides, the
same compiled rates): for each method the loosest tolerance whose largest error is not above the
plant's own.
"""

import argparse
import json
import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(
    0, str(Path(__file__).parents[1])
)  # for the tests' scenarios, which are not installed

from epa_rt.models import plant
from epa_rt.models.blocks import bus, drive
from epa_rt.models.chain import rates
from epa_rt.models.compiled import compiled
from epa_rt.models.plant_file import PlantFile, load_plant
from epa_rt.models.ports import ANGLE, CREEP, CURRENT, GAS_C, INTEGRAL, RING, SENSORS, SMOOTH, SPEED
from tests.models.plant_scenarios import SENSOR_STEP, log_commands

PERIOD_S = 1e-3
PLANTS = Path(__file__).parents[1] / "config" / "plants"
RIVAL_S = 20.0  # seconds of log that solve_ivp gets: its time is proportional, and it is slow
CHECKED = {ANGLE: "motor_angle_rad", SPEED: "motor_speed_rad_s", CURRENT: "motor_current_a"}


def quiet(params: np.ndarray) -> np.ndarray:
    """A copy without sensor noise."""
    params = params.copy()
    for name in params["sensors"].dtype.names:
        if "_noise" in name:
            params["sensors"][name] = 0.0
    return params


def simulate(params: np.ndarray, commands: np.ndarray, substeps: int) -> np.ndarray:
    out = np.zeros(len(commands), SENSORS)
    plant.run(params, plant.new_state(params), commands, PERIOD_S, substeps, out)
    return out


def errors(got: np.ndarray, reference: np.ndarray) -> dict[str, float]:
    """Largest error per sensor, in steps of that sensor."""
    return {
        name: float(np.max(np.abs(got[name] - reference[name])) / step)
        for name, step in SENSOR_STEP.items()
    }


def speed(file: PlantFile, commands: np.ndarray, repeats: int) -> dict[str, float]:
    out, times = np.zeros(len(commands), SENSORS), []
    for _ in range(repeats):
        state = plant.new_state(file.params)
        start = time.perf_counter()
        plant.run(file.params, state, commands, PERIOD_S, file.substeps, out)
        times.append(time.perf_counter() - start)
    span_s = len(commands) * PERIOD_S
    return {
        "us_per_cycle_median": statistics.median(times) / len(commands) * 1e6,
        "us_per_cycle_best": min(times) / len(commands) * 1e6,
        "times_real_time_median": span_s / statistics.median(times),
        "times_real_time_best": span_s / min(times),
    }


@compiled
def rival_rates(moment_s, y, dy, params, state, table, last, period_s):
    """The plant's own compiled rates at a time inside the log; valve openings are states
    y[SMOOTH:].
    """
    p, s = params[0], state[0]
    k = min(int(moment_s / period_s + 1e-9), last)
    row, part = table[k], moment_s / period_s - k
    for i in range(2):
        for j in range(2):
            s.opening[i, j] = y[SMOOTH + 2 * i + j]
            valve = row[(bus.INLET, bus.EXHAUST)[j] + i]
            dy[SMOOTH + 2 * i + j] = (valve - s.opening[i, j]) / p.gas[i].valve_lag_s
    rates(
        p,
        s,
        y,
        dy,
        (
            row[bus.ENABLED],
            row[bus.MODE],
            row[bus.TORQUE],
            row[2],
            row[3],
            row[4],
            row[5],
            row[6],
            row[7],
        ),
        part,
    )


@compiled
def latch_all(state, commands, table, period_s):
    """The ring row of every command: what the bus block makes of it."""
    s = state[0]
    for k in range(commands.shape[0]):
        bus.latch(s, commands[k], period_s)
        table[k] = s.ring[k % RING]
        s.cycle += 1


def rival(
    params: np.ndarray, commands: np.ndarray, method: str, rtol: float
) -> tuple[float, np.ndarray]:
    """Time (s) and states at the cycle ends of solve_ivp, one call from each switch of valves or
    drive to the next.
    """
    from scipy.integrate import solve_ivp

    state, n = plant.new_state(params), len(commands)
    y = np.concatenate([state["smooth"][0], np.zeros(4)])
    table, ends, dy = (
        np.zeros((n, state["ring"].shape[2])),
        np.zeros((n, SMOOTH + 4)),
        np.zeros(SMOOTH + 4),
    )
    scale = np.ones(SMOOTH + 4)
    scale[GAS_C:CREEP] = y[GAS_C:CREEP]
    latch_all(state.copy(), commands, table, PERIOD_S)
    switches = table[:, [bus.ENABLED, bus.MODE, *range(bus.INLET, bus.INLET + 4)]]
    edges = [0, *(np.flatnonzero(np.any(np.diff(switches, axis=0) != 0, axis=1)) + 1), n]

    def rate(moment_s: float, values: np.ndarray) -> np.ndarray:
        rival_rates(moment_s, values, dy, params, state, table, end - 1, PERIOD_S)
        return dy.copy()

    start = time.perf_counter()
    for first, end in zip(edges[:-1], edges[1:], strict=True):
        y[INTEGRAL] = drive.integral_at_edge(
            table[first], table[first - 1] * (first > 0), y[INTEGRAL], y[CURRENT]
        )
        moments = np.arange(first + 1, end + 1) * PERIOD_S
        solved = solve_ivp(
            rate,
            (first * PERIOD_S, moments[-1]),
            y,
            method=method,
            t_eval=moments,
            rtol=rtol,
            atol=rtol * scale,
        )
        ends[first:end] = solved.y.T
        y = ends[end - 1].copy()
    return time.perf_counter() - start, ends


def compare(file: PlantFile, commands: np.ndarray, ours_us: float) -> dict:
    """Ratio to the fastest solve_ivp method at the plant's own accuracy, judged on motor angle,
    speed and current.
    """
    params, commands = quiet(file.params), commands[: int(RIVAL_S / PERIOD_S)]
    params["sensors"]["encoder_hold_s"] = 0.0
    reference = simulate(params, commands, 32 * file.substeps)
    own = errors(simulate(params, commands, file.substeps), reference)
    allowed = max(own[name] for name in CHECKED.values())
    rival(params, commands[:200], "RK45", 1e-3)
    tried = {}
    for method in ("RK45", "DOP853", "LSODA"):
        for rtol in (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8):
            seconds, ends = rival(params, commands, method, rtol)
            error = max(
                float(np.max(np.abs(ends[:, column] - reference[name])) / SENSOR_STEP[name])
                for column, name in CHECKED.items()
            )
            tried[method] = {
                "rtol": rtol,
                "error_steps": error,
                "us_per_cycle": seconds / len(commands) * 1e6,
            }
            if error <= allowed:
                break
        tried[method]["accurate_enough"] = error <= allowed
    best = min(
        (t for t in tried.values() if t["accurate_enough"]),
        key=lambda t: t["us_per_cycle"],
        default=None,
    )
    return {
        "own_error_steps": allowed,
        "tried": tried,
        "ratio": best["us_per_cycle"] / ours_us if best else None,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "plants", nargs="*", default=["bench", "knee"], help="names under config/plants"
    )
    parser.add_argument("--seconds", type=float, default=200.0, help="length of the log")
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--no-scipy", action="store_true", help="leave solve_ivp out")
    given = parser.parse_args()
    report = {}
    for name in given.plants:
        file = load_plant(PLANTS / f"{name}.yaml")
        commands = log_commands(file, given.seconds, PERIOD_S)
        simulate(file.params, commands[:10], file.substeps)
        row = {
            "substeps": file.substeps,
            "seconds": given.seconds,
            **speed(file, commands, given.repeats),
        }
        own = simulate(quiet(file.params), commands, file.substeps)
        row["error_steps"] = errors(own, simulate(quiet(file.params), commands, 32 * file.substeps))
        if not given.no_scipy:
            silent = replace(file, params=quiet(file.params))
            row["us_per_cycle_median_noise_off"] = speed(silent, commands, given.repeats)[
                "us_per_cycle_median"
            ]
            row["solve_ivp"] = compare(file, commands, row["us_per_cycle_median_noise_off"])
        report[name] = row
    print(json.dumps(report, indent=2))


if __name__ == "__main__":
    main()
