"""One point of a study against what is known: a linear muscle, energy, step size, and eq. (8) taken
literally.
"""

import numpy as np
import pytest

from epa_rt.models.plant_file import load_plant
from epa_rt.study import servo_loop as loop
from epa_rt.study.motion import Drive, measure, point, trace
from tests.study.made import ATMOSPHERE_PA, ROOT, SERIAL, linear


@pytest.mark.parametrize(
    ("stiffness", "damping", "omega"),
    [(5000.0, 5.0, 40.0), (5000.0, 5.0, 80.0), (4000.0, 20.0, 60.0), (8000.0, 1.0, 110.0)],
)
def test_a_linear_muscle_takes_what_the_closed_form_says(stiffness, damping, omega):
    params = linear(stiffness, damping)
    found = point(params, (800e3, ATMOSPHERE_PA), 0.0, 0.01, omega)
    wanted = abs(1.0 - params["load"]["mass_kg"][0] * omega**2 / (stiffness + 1j * omega * damping))
    assert found.stroke_m / found.motion_m == pytest.approx(wanted, rel=0.01)


def test_work_of_the_spool_is_what_the_damper_burns():
    damping, omega = 20.0, 60.0
    rows, _ = trace(linear(4000.0, damping), (800e3, ATMOSPHERE_PA), 0.0, 0.01, omega)
    force, seconds = rows[:, loop.FORCE0], rows[:, loop.TIME]
    stretch_speed = rows[:, loop.TRAVEL_SPEED] + rows[:, loop.PLACE_SPEED]
    given = np.trapezoid(force * rows[:, loop.TRAVEL_SPEED], seconds)
    assert given == pytest.approx(np.trapezoid(damping * stretch_speed**2, seconds), rel=0.02)


def test_half_the_step_gives_the_same():
    params = load_plant(SERIAL).params
    whole, half = (
        point(params, (700e3, ATMOSPHERE_PA), 0.0, 0.01, 80.0, Drive(step_s=step))
        for step in (1e-4, 5e-5)
    )
    for name in ("stroke_m", "motion_m", "peak_power_w", "tension_high_n"):
        assert getattr(whole, name) == pytest.approx(getattr(half, name), rel=0.005), name


def test_tension_carries_load_and_inertia():
    """Mean tension is the constant load; its swing is m w^2 times the motion."""
    params = load_plant(SERIAL).params
    found = point(params, (900e3, ATMOSPHERE_PA), 0.0, 0.01, 60.0)
    assert found.tension_mean_n == pytest.approx(133.8, rel=0.005)
    assert found.tension_high_n - found.tension_low_n == pytest.approx(
        0.759 * 60.0**2 * found.motion_m, rel=0.02
    )


def test_eq_8_taken_literally_runs_away():
    found = point(
        load_plant(ROOT / "config/plants/serial_eq8.yaml").params,
        (600e3, ATMOSPHERE_PA),
        0.0,
        0.01,
        80.0,
        Drive(step_s=1e-5),
    )
    assert found.runaway_s > 0.0
    assert np.isnan(found.stroke_m)


@pytest.mark.parametrize(("pressure_pa", "runs_away"), [(850e3, False), (1000e3, True)])
def test_without_c3_it_is_the_damping_that_turns_negative(pressure_pa, runs_away):
    found = point(
        load_plant(ROOT / "config/plants/serial_eq8_no_c3.yaml").params,
        (pressure_pa, ATMOSPHERE_PA),
        0.0,
        0.01,
        80.0,
        Drive(step_s=4e-5),
    )
    assert (found.runaway_s > 0.0) == runs_away


def test_nothing_is_measured_of_a_run_away():
    assert np.isnan(
        measure(load_plant(SERIAL).params, np.zeros((0, loop.COLUMNS)), 0.2).peak_power_w
    )
