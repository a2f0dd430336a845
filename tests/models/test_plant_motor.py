"""Motor and gear: what the drive reports of its torque, and the gear's friction, which gives no
energy.
"""

import numpy as np
import pytest
from catalogue_scenes import opened, truths
from hypothesis import example, given, settings
from hypothesis import strategies as st

from epa_rt.models.blocks import motor, transmission
from epa_rt.models.blocks.drive import drive_over_log
from epa_rt.models.blocks.friction import slider
from epa_rt.models.compiled import compiled
from epa_rt.models.parameters import neutral_params

HIDDEN_FROM_THE_DRIVE = dict(
    cogging_nm=4e-3, torque_ripple_ratio=0.05, torque_saturation_per_a=0.02, torque_loss_per_k=2e-3
)


def gear(**values) -> np.ndarray:
    params = neutral_params()
    for name, value in values.items():
        params["transmission"][name] = value
    return params


@compiled
def torques(params, current, angle, heat, out):
    for k in range(len(out)):
        out[k] = motor.motor_torque(params[0].drive, current[k], angle[k], heat[k])


@compiled
def limits(params, load_torque, speed, out):
    for k in range(out.shape[1]):
        out[0, k], out[1, k] = transmission.friction_limits(
            params[0].transmission, load_torque[k], speed[k]
        )


@compiled
def rubbed(params, load_torque, speed, step_s, force, stuck):
    """Friction of motor and gear along a motion, and the deflection of its spring at the end of
    each step.
    """
    d, z = params[0].drive, 0.0
    for k in range(len(speed)):
        low, high = transmission.friction_limits(params[0].transmission, load_torque[k], speed[k])
        dry = motor.dry_limit(d, speed[k], 0.0)
        force[k], rate = slider(
            d.presliding_stiffness_nm_rad, d.presliding_time_s, z, speed[k], low - dry, high + dry
        )
        force[k] += transmission.sliding_torque(
            params[0].transmission, params[0].drive.inertia_kg_m2, load_torque[k], speed[k]
        )
        z += step_s * rate
        stuck[k] = z


def limits_of(params: np.ndarray, load_torque, speed) -> np.ndarray:
    load_torque, speed = np.broadcast_arrays(
        np.atleast_1d(np.asarray(load_torque, float)), np.asarray(speed, float)
    )
    out = np.empty((2, len(speed)))
    limits(params, np.array(load_torque), np.array(speed), out)
    return out


@compiled
def sliding_torques(params, load_torque, speed, out):
    for k in range(len(out)):
        out[k] = transmission.sliding_torque(
            params[0].transmission, params[0].drive.inertia_kg_m2, load_torque[k], speed[k]
        )


def slid(params: np.ndarray, load_torque: np.ndarray, speed: np.ndarray) -> np.ndarray:
    out = np.empty(len(speed))
    sliding_torques(params, load_torque, speed, out)
    return out


@pytest.mark.parametrize("effects", [{}, HIDDEN_FROM_THE_DRIVE], ids=["plain", "hidden"])
def test_the_drive_reports_its_current_times_the_constant_it_was_set_up_with(effects):
    scene = opened("bench")
    params = scene.params.copy()
    for name, value in effects.items():
        params["drive"][name] = value
    out, truth = truths(params, scene)
    constant = float(params["drive"]["torque_constant_nm_a"][0])
    assert np.array_equal(truth["motor_torque_nm"], constant * truth["motor_current_a"])
    assert np.array_equal(out["motor_torque_nm"], truth["motor_torque_nm"])
    current, reported = drive_over_log(
        params,
        scene.commands,
        truth["motor_angle_rad"],
        truth["motor_speed_rad_s"],
        1e-3,
        scene.substeps,
    )
    assert np.array_equal(reported, constant * current)
    on_the_shaft = np.empty(len(truth))
    torques(
        params,
        truth["motor_current_a"],
        truth["motor_angle_rad"],
        truth["winding_heat_k"],
        on_the_shaft,
    )
    apart = np.max(np.abs(on_the_shaft - truth["motor_torque_nm"]))
    assert apart == 0.0 if not effects else apart > 2e-3


def test_dry_friction_of_the_gear_is_sharp_or_builds_up_with_speed():
    dry = 10.0 * 0.010 / 19.0
    speed = np.array([0.0, 1e-9, 0.3, 5.0, -5.0, 45.0, 900.0])
    assert np.array_equal(
        limits_of(gear(gear_friction_n=10.0), 0.0, speed),
        np.stack([np.full(7, -dry), np.full(7, dry)]),
    )
    low, high = limits_of(gear(gear_friction_n=10.0, gear_friction_speed_rad_s=5.0), 0.0, speed)
    assert np.array_equal(low, -high)
    assert high == pytest.approx(
        dry * np.array([0.0, 2e-10, 0.3 / 5.3, 0.5, 0.5, 0.9, 900.0 / 905.0]), rel=1e-12
    )


def test_without_friction_of_the_gear_the_speed_of_its_build_up_is_nothing():
    load, speed = np.linspace(-0.1, 0.1, 41), np.linspace(40.0, -40.0, 41)
    plain = limits_of(gear(), load, speed)
    rise = gear(
        gear_friction_speed_rad_s=7.0, gear_friction_sharpness_ratio=3.0, gear_sliding_ratio=0.6
    )
    assert plain.tobytes() == limits_of(rise, load, speed).tobytes()
    assert not np.any(slid(rise, load, speed))


@given(st.floats(1.0, 8.0), st.floats(0.1, 50.0), st.floats(0.2, 1.0), st.floats(0.0, 500.0))
def test_friction_of_the_gear_builds_up_from_nothing_to_all_of_it(
    sharpness, speed_rad_s, efficiency, dry_n
):
    load, speed = np.linspace(-0.1, 0.1, 5), np.linspace(0.0, 1e5, 5)
    plain = limits_of(gear(gear_efficiency_ratio=efficiency, gear_friction_n=dry_n), load, speed)
    built = limits_of(
        gear(
            gear_efficiency_ratio=efficiency,
            gear_friction_n=dry_n,
            gear_friction_speed_rad_s=speed_rad_s,
            gear_friction_sharpness_ratio=sharpness,
        ),
        load,
        speed,
    )
    assert np.all(built[:, 0] == 0.0)
    assert np.all(np.abs(built) <= np.abs(plain) * (1.0 + 1e-12))
    assert built[:, -1] == pytest.approx(plain[:, -1], rel=2e-3, abs=1e-12)


@given(
    st.floats(0.0, 1.0),
    st.floats(1.0, 8.0),
    st.floats(0.6, 50.0),
    st.floats(0.2, 1.0),
    st.floats(0.0, 500.0),
    st.floats(-0.1, 0.1),
    st.floats(-60.0, 60.0),
)
def test_what_slides_and_what_sticks_of_it_are_together_all_of_it(
    sliding, sharpness, speed_rad_s, efficiency, dry_n, load, speed
):
    """Where the slider gives way; less where it would stop the shaft before a sub-step has
    followed.
    """

    def shares(ratio):
        params = gear(
            gear_efficiency_ratio=efficiency,
            gear_friction_n=dry_n,
            gear_friction_speed_rad_s=speed_rad_s,
            gear_friction_sharpness_ratio=sharpness,
            gear_sliding_ratio=ratio,
        )
        return (
            limits_of(params, load, speed)[:, 0],
            slid(params, np.array([load]), np.array([speed]))[0],
        )

    (low, high), _ = shares(0.0)
    (still_low, still_high), slides = shares(sliding)
    there, all_of_it = (slides + still_high, high) if speed >= 0.0 else (slides + still_low, low)
    at_once = limits_of(gear(gear_efficiency_ratio=efficiency, gear_friction_n=dry_n), load, speed)
    stops_in_s = (
        float(gear()["drive"]["inertia_kg_m2"][0])
        * speed_rad_s
        / max(sliding * np.max(np.abs(at_once)), 1e-12)
    )
    if stops_in_s >= transmission.FOLLOWED_S:
        assert there == pytest.approx(all_of_it, rel=1e-9, abs=1e-15)
    assert abs(there) <= abs(all_of_it) * (1.0 + 1e-9) + 1e-15 and slides * speed >= 0.0


def test_what_slides_never_stops_the_shaft_sooner_than_a_sub_step_follows():
    """Its slope over speed is at most the shaft's inertia over that time."""
    speed = np.linspace(0.0, 50.0, 501)
    params = gear(gear_friction_n=500.0, gear_sliding_ratio=1.0)
    torque = slid(params, np.zeros(len(speed)), speed)
    slope = np.diff(torque) / np.diff(speed)
    assert (
        slope.max() <= float(params["drive"]["inertia_kg_m2"][0]) / transmission.FOLLOWED_S
        and slope.min() >= 0.0
    )
    assert torque[-1] > 0.5 * limits_of(gear(gear_friction_n=500.0), 0.0, 1.0)[1, 0]


corners = st.lists(st.floats(-60.0, 60.0), min_size=3, max_size=8)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    corners,
    st.floats(0.0, 500.0),
    st.floats(0.0, 50.0),
    st.floats(0.2, 1.0),
    st.floats(-0.3, 0.3),
    st.floats(0.0, 1.0),
)
@example([60.0, -60.0, 0.5, -0.5, 0.0], 500.0, 50.0, 0.2, 0.3, 0.0)
@example([60.0, -60.0, 0.5, -0.5, 0.0], 500.0, 1e-6, 1.0, 0.0, 0.0)
@example([60.0, -60.0, 0.5, -0.5, 0.0], 500.0, 1e-6, 1.0, 0.0, 1.0)
def test_friction_of_motor_and_gear_never_gives_more_energy_than_it_took(
    turns, dry_n, build_up, efficiency, load, sliding
):
    """Work in minus what its spring holds never falls, at any moment, whatever the limits do."""
    params = gear(
        gear_friction_n=dry_n,
        gear_friction_speed_rad_s=build_up,
        gear_efficiency_ratio=efficiency,
        gear_sliding_ratio=sliding,
    )
    step_s = 1e-5
    speed = np.interp(np.linspace(0.0, 1.0, 4000), np.linspace(0.0, 1.0, len(turns)), turns)
    force, stuck = np.empty(len(speed)), np.empty(len(speed))
    rubbed(params, load * np.cos(np.linspace(0.0, 20.0, len(speed))), speed, step_s, force, stuck)
    stiffness, before = (
        float(params["drive"]["presliding_stiffness_nm_rad"][0]),
        np.concatenate([[0.0], stuck[:-1]]),
    )
    lost = force * speed * step_s - 0.5 * stiffness * (stuck**2 - before**2)
    slack = (
        0.5 * stiffness * (stuck - before) ** 2
    )  # what the explicit step itself adds to the spring
    assert np.all(lost >= -slack - 1e-15)


def test_the_plant_with_such_friction_needs_less_current_where_it_turns_slowly():
    """Against the same weight of friction, sharp or built up: alike at speed, less near
    standstill.
    """
    scene = opened("bench")
    sharp, soft = scene.params.copy(), scene.params.copy()
    sharp["transmission"]["gear_friction_n"] = soft["transmission"]["gear_friction_n"] = 40.0
    soft["transmission"]["gear_friction_speed_rad_s"] = 5.0
    one, other = truths(sharp, scene)[1], truths(soft, scene)[1]
    less = np.abs(one["motor_current_a"]) - np.abs(other["motor_current_a"])
    with_motor = one["motor_current_a"] * one["motor_speed_rad_s"] > 0.0
    slow, fast = (
        (np.abs(one["motor_speed_rad_s"]) < 3.0) & with_motor,
        (np.abs(one["motor_speed_rad_s"]) > 40.0) & with_motor,
    )
    assert slow.sum() > 100 and fast.sum() > 100
    assert np.median(less[slow]) > 3.0 * abs(np.median(less[fast]))


@pytest.mark.parametrize("sharpness", [1.0, 2.0, 8.0])
@pytest.mark.parametrize("speed", [1e-12, 1e-60, 2e-313])
def test_friction_of_the_gear_that_builds_up_over_next_to_no_speed_is_all_there(sharpness, speed):
    """Powers of a speed over next to nothing overflow: the friction had been none, or no number."""
    shape = {"gear_friction_n": 20.0, "gear_friction_sharpness_ratio": sharpness}
    assert limits_of(gear(**shape, gear_friction_speed_rad_s=speed), 0.0, 100.0) == pytest.approx(
        limits_of(gear(**shape), 0.0, 100.0), rel=1e-9
    )
    assert not limits_of(gear(gear_friction_speed_rad_s=speed), 0.0, 100.0).any()
