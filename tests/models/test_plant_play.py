"""Play of the gear: hard or gradual, rate independent, however a motion is cut into rows."""

import numpy as np
import pytest
from catalogue_scenes import opened, truths
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.models.blocks import transmission
from epa_rt.models.compiled import compiled
from epa_rt.models.parameters import neutral_params
from epa_rt.models.tables_motor import TRANSMISSION

HALF = 0.5 * 9.6e-3 * 0.010  # m
ROUNDNESS = (1e-6, 0.02, 0.1, 0.3, 0.5, 0.8, 1.0)
moves = st.lists(st.floats(-4.0, 4.0), min_size=1, max_size=12)  # over half the play
roundnesses = st.sampled_from(ROUNDNESS)


@compiled
def _played(params, geared, out):
    travel = before = geared[0]
    for k in range(len(geared)):
        travel, carried = transmission.play(params[0].transmission, geared[k], before, travel, 0.0)
        before = geared[k]
        out[0, k], out[1, k] = travel, carried


def played(geared, roundness: float, play_rad: float = 9.6e-3) -> np.ndarray:
    """Travel behind the play and the part carried, (2, N), from the travel before it (N,), centred
    at first.
    """
    params = neutral_params()
    params["transmission"]["backlash_rad"], params["transmission"]["backlash_roundness_ratio"] = (
        play_rad,
        roundness,
    )
    out = np.empty((2, len(geared)))
    _played(params, np.asarray(geared, float), out)
    return out


def path(turns, parts: int = 1, start: float = 0.0) -> np.ndarray:
    """Travel through moves (over half the play), each cut in as many parts."""
    corners = start + HALF * np.concatenate([[0.0], np.cumsum(turns)])
    pieces = [
        np.linspace(a, b, parts, endpoint=False)
        for a, b in zip(corners[:-1], corners[1:], strict=True)
    ]
    return np.concatenate([*pieces, corners[-1:]])


def hard(geared) -> np.ndarray:
    """Hard play as it is written down: the strap stays inside the gap."""
    travel = [geared[0]]
    for x in geared:
        travel.append(
            x + HALF if travel[-1] > x + HALF else x - HALF if travel[-1] < x - HALF else travel[-1]
        )
    return np.array(travel[1:])


def test_without_play_its_roundness_is_nothing():
    geared = path([3.0, -5.0, 0.5], 7, start=0.013)
    for roundness in (0.0, *ROUNDNESS):
        assert np.array_equal(
            played(geared, roundness, play_rad=0.0), np.stack([geared, np.ones(len(geared))])
        )


@given(moves)
def test_without_roundness_play_is_hard_to_the_bit(turns):
    geared = path(turns, 5, start=0.013)
    assert played(geared, 0.0)[0].tobytes() == hard(geared).tobytes()


@given(moves, roundnesses, st.sampled_from([1, 4, 50]))
def test_the_gap_is_never_wider_than_the_play_and_the_part_carried_is_one(turns, roundness, parts):
    geared = path(turns, parts)
    travel, carried = played(geared, roundness)
    assert np.max(np.abs(geared - travel)) <= HALF * (1.0 + 1e-12)
    assert np.all((carried >= 0.0) & (carried <= 1.0))


@given(moves, roundnesses)
def test_it_does_not_matter_how_a_motion_is_cut(turns, roundness):
    whole = played(path(turns), roundness)[0]
    for parts in (3, 30):
        assert (
            np.max(np.abs(played(path(turns, parts), roundness)[0][::parts] - whole)) < 1e-6 * HALF
        )


@pytest.mark.parametrize("roundness", [0.1, 0.3, 0.5, 0.8, 1.0])
def test_the_way_follows_the_slope_and_the_slope_is_what_the_page_says(roundness):
    """Against the differential equation of docs/plant.md, in small steps; the part carried is the
    travel's own slope.
    """
    geared = path([2.5, -4.0, 1.5, -0.7], 4000)
    travel, carried = played(geared, roundness)
    x, steps = np.zeros(len(geared)), np.diff(geared)
    for k, step in enumerate(steps):
        middle = geared[k] + 0.5 * step
        x[k + 1] = x[k] + step * page_slope(
            middle - x[k] - 0.5 * step * page_slope(geared[k] - x[k], step, roundness),
            step,
            roundness,
        )
    assert np.max(np.abs(travel - x)) < 2e-4 * HALF
    slopes = np.diff(travel) / steps
    assert (
        np.max(
            np.abs(0.5 * (carried[1:] + carried[:-1]) - slopes)[
                np.sign(steps) == np.sign(np.roll(steps, 1))
            ]
        )
        < 5e-3
    )


def page_slope(gap: float, step: float, roundness: float) -> float:
    w = (abs(gap) / HALF) ** (1.0 / roundness)
    if gap * step <= 0.0 or w == 0.0:
        return 0.0
    return 1.0 if w >= 1.0 else 1.0 - (1.0 - w) * (-np.log1p(-w) / w) ** (1.0 - roundness)


@pytest.mark.parametrize("roundness", ROUNDNESS)
@pytest.mark.parametrize(("swing", "closed_to"), [(0.6, 2e-3), (2.0, 1e-9), (5.0, 1e-9)])
def test_a_cycle_closes_and_lies_within_that_of_hard_play(roundness, swing, closed_to):
    """Once run in (slowly, where a swing hardly leaves the gap) the strap comes back to where it
    was, and nothing drifts.
    """
    laps = played(path([swing, -2.0 * swing, swing] * 60, 20), roundness)[0][1:].reshape(60, 60)
    assert np.max(np.abs(laps[-1] - laps[-2])) < closed_to * HALF
    reach = np.max(laps, axis=1)
    assert np.all(reach <= swing * HALF) and np.all(np.min(laps, axis=1) >= -swing * HALF)
    reached, hardly = (
        np.ptp(laps[-1]),
        np.ptp(hard(path([swing, -2.0 * swing, swing] * 2, 20))[60:]),
    )
    assert (
        hardly - 1e-4 * HALF <= reached <= 2.0 * swing * HALF
    )  # what is carried early is not lost: the loop is narrower


@pytest.mark.parametrize("roundness", [0.5, 1.0])
def test_back_in_the_gap_the_strap_stays_to_the_bit(roundness):
    geared = path([3.0, -0.9], 40, start=0.02)
    travel, carried = played(geared, roundness)
    assert len(set(travel[41:])) == 1 and np.all(carried[41:] == 0.0)


def test_little_roundness_is_nearly_hard_play():
    geared = path([3.0, -5.0, 1.3, -0.4, 4.0], 50)
    assert np.max(np.abs(played(geared, 1e-6)[0] - hard(geared))) < 1e-4 * HALF
    apart = [
        np.max(np.abs(played(geared, roundness)[0] - hard(geared))) / HALF
        for roundness in ROUNDNESS
    ]
    assert apart == sorted(apart) and 0.1 < apart[4] < 0.3


def test_the_row_is_bounded_where_the_law_begins_and_where_it_would_become_another():
    row = next(row for row in TRANSMISSION if row.name == "backlash_roundness_ratio")
    assert (row.neutral, row.low, row.high, row.unit) == (0.0, 0.0, 1.0, "1")


@pytest.mark.parametrize("roundness", [0.0, 0.3, 1.0])
def test_the_plant_moves_its_strap_as_the_play_alone_and_at_the_speed_that_it_says(roundness):
    scene = opened("bench")
    params = scene.params.copy()
    params["transmission"]["backlash_rad"], params["transmission"]["backlash_roundness_ratio"] = (
        9.6e-3,
        roundness,
    )
    t = truths(params, scene)[1]
    travel, speed = t["travel_m"], t["travel_speed_m_s"]
    alone, _ = transmission.transmission_over_log(params, t["motor_angle_rad"], t["spool_force_n"])
    assert np.max(np.abs(alone - travel)) < 0.05 * HALF  # a reversal within a cycle
    moved, said = np.diff(travel), 0.5e-3 * (speed[1:] + speed[:-1])
    assert np.sqrt(np.mean((moved - said) ** 2)) < 0.02 * np.sqrt(np.mean(moved**2))


@given(moves, st.floats(0.0, 0.95), st.floats(0.5, 8.0), st.floats(-6.0, 6.0), st.floats(0.5, 8.0))
def test_uneven_play_is_hard_play_as_wide_as_where_the_spool_stands(
    turns, ratio, places, phase, narrowness
):
    params = neutral_params()
    spool = params["transmission"]
    spool["uneven_backlash_rad"], spool["backlash_wave_ratio"], spool["backlash_phase_rad"] = (
        9.6e-3,
        ratio,
        phase,
    )
    spool["backlash_per_turn_ratio"], spool["backlash_narrowness_ratio"] = places, narrowness
    geared, out = (
        path([40.0 * turn for turn in turns], 50, start=0.013),
        np.empty((2, 50 * len(turns) + 1)),
    )
    _played(params, np.asarray(geared), out)
    swing = 0.5 + 0.5 * np.sin(places * geared / float(spool["spool_radius_m"][0]) + phase)
    half = HALF * (1.0 + ratio * (2.0 * swing**narrowness - 1.0))
    behind = [geared[0]]
    for x, h in zip(geared, half, strict=True):
        behind.append(min(max(behind[-1], x - h), x + h))
    assert np.max(np.abs(out[0] - behind[1:])) < 1e-12
    assert set(out[1]) <= {0.0, 1.0}


@given(moves)
def test_uneven_play_without_a_wave_is_play(turns):
    geared = path(turns, 5, start=0.013)
    params = neutral_params()
    params["transmission"]["uneven_backlash_rad"], params["transmission"]["backlash_wave_ratio"] = (
        9.6e-3,
        0.0,
    )
    out = np.empty((2, len(geared)))
    _played(params, np.asarray(geared), out)
    assert np.max(np.abs(out[0] - hard(geared))) < 1e-15
