"""What the report measures, on columns whose answer is known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from epa_rt.report.measures.energy import energy_of_periods
from epa_rt.report.measures.pressures import trial_pressures
from epa_rt.report.measures.timing import timing_of
from epa_rt.report.measures.tracking import periods_of, tracking_of
from epa_rt.report.measures.valves import valve_counts
from epa_rt.report.run import Run
from epa_rt.report.sections.timing import timing


def changed(run: Run, **columns: np.ndarray) -> Run:
    return dataclasses.replace(run, signals=run.signals | columns)


def test_an_offset_is_found_as_it_is(bench: Run) -> None:
    run = changed(bench, motor_travel_m=bench.signals["ref_motor_travel_m"] + 0.0005)
    found = tracking_of(run, run.trials[0])
    assert (
        found.rms == pytest.approx(0.0005)
        and found.peak == pytest.approx(0.0005)
        and found.bias == pytest.approx(0.0005)
    )


def test_invalid_samples_do_not_spoil_the_rest(bench: Run) -> None:
    travel = bench.signals["ref_motor_travel_m"] + 0.0005
    travel[bench.trials[0].begin + 7] = np.nan
    assert tracking_of(changed(bench, motor_travel_m=travel), bench.trials[0]).rms == pytest.approx(
        0.0005
    )


@pytest.mark.parametrize("ratio, lag_deg", [(1.0, 0.0), (0.8, 10.0), (1.2, -5.0)])
def test_amplitude_and_lag_of_each_period_are_found(
    knee: Run, ratio: float, lag_deg: float
) -> None:
    trial = knee.trials[0]
    planned, lag = trial.phase.motion.planned, np.radians(lag_deg)
    t_s = np.arange(trial.end - trial.begin) * knee.period_s
    angle = 2 * np.pi * (0.5 * t_s + 0.5 * 1.5 / 12.0 * t_s**2)
    measured = knee.signals["knee_angle_rad"].copy()
    measured[trial.samples] = planned.mean + ratio * planned.amplitude * np.sin(angle - lag)
    periods = periods_of(changed(knee, knee_angle_rad=measured), trial)
    assert periods.ratio == pytest.approx(ratio, rel=0.02)
    assert np.degrees(periods.lag_rad) == pytest.approx(lag_deg, abs=3.0)
    assert 0.5 < periods.frequency_hz.min() < 1.0 < periods.frequency_hz.max() < 2.0
    assert np.all(np.diff(periods.frequency_hz) > 0.0)


def test_energy_of_a_period_under_a_constant_current(knee: Run) -> None:
    run = changed(knee, motor_current_a=np.full(len(knee.t_s), 2.0))
    periods = periods_of(run, run.trials[0])
    assert energy_of_periods(run, periods) == pytest.approx(4.0 / periods.frequency_hz)


def test_drift_is_told_apart_from_motion(bench: Run) -> None:
    trial = bench.trials[1]
    x = bench.signals["motor_travel_m"][trial.samples]
    pressure = bench.signals["muscle_pressure_pa"].copy()
    pressure[trial.samples] = 700e3 + 2e6 * x + 1e8 * x**2 + np.linspace(0.0, -3000.0, len(x))
    found = trial_pressures(changed(bench, muscle_pressure_pa=pressure), trial)[0]
    assert found.drift_pa == pytest.approx(-3000.0, rel=0.01)


def test_pressure_counts_only_from_the_last_switching_on(bench: Run) -> None:
    trial = bench.trials[0]
    pressure, inlet = (
        bench.signals["muscle_pressure_pa"].copy(),
        bench.signals["cmd_muscle_inlet_open"].copy(),
    )
    pressure[: trial.begin - 100], pressure[trial.begin - 100 : trial.begin] = 1e5, 5e5
    inlet[trial.begin - 101] = 1.0
    found = trial_pressures(
        changed(bench, muscle_pressure_pa=pressure, cmd_muscle_inlet_open=inlet), trial
    )[0]
    assert found.start_pa == pytest.approx(5e5)


def test_a_switching_in_a_trial_is_counted_there(bench: Run) -> None:
    inlet = bench.signals["cmd_muscle_inlet_open"].copy()
    inlet[bench.trials[0].begin + 10 : bench.trials[0].begin + 20] = 1.0
    before, after = valve_counts(bench), valve_counts(changed(bench, cmd_muscle_inlet_open=inlet))
    assert after[0].in_trials == 2 and after[0].total == before[0].total + 2
    assert after[1] == before[1]


def test_lateness_quantiles_are_values_that_occurred(bench: Run) -> None:
    lateness = np.zeros(10_000, np.int64)
    lateness[:100], lateness[:5] = 50_000, 900_000
    cycle = {name: column[:10_000] for name, column in bench.cycle.items()} | {
        "lateness_ns": lateness
    }
    found = timing_of(dataclasses.replace(bench, cycle=cycle))
    assert found.lateness_ns == {"p50": 0, "p99": 0, "p99.9": 50_000, "max": 900_000}
    assert found.lateness_counts.sum() == 10_000
    assert found.lateness_counts[-7] == 5  # 512 to 1024 us


def test_timing_of_a_paced_run_is_shown(bench: Run) -> None:
    cycle = bench.cycle | {"lateness_ns": np.full(len(bench.t_s), 42_000, np.int64)}
    content = timing(dataclasses.replace(bench, cycle=cycle)).content
    assert "Lateness, µs" in content and "42.00" in content
