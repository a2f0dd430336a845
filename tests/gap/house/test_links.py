"""Links without a gap leave noise alone, with a gap more, and the same whatever thread asks."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.rig.house import gas_link, motor_link
from epa_rt.gap.rig.house.evaluate import Bench
from tests.gap import toy
from tests.gap.house.runs import recorded, rms, subject
from tests.gap.recorded import rows_left

# rms that a rig without a gap may leave: converters' steps and noise, through the low-pass
QUIET = {
    "bench": {
        "drive": 4e-3,
        "motor": 3e-3,
        "torque": 2e-4,
        "gas0": 200.0,
        "muscle0": 0.12,
        "encoder": 0.05,
    },
    "knee": {
        "drive": 12e-3,
        "motor": 4e-3,
        "torque": 2e-4,
        "gas0": 200.0,
        "gas1": 200.0,
        "muscle0": 0.13,
        "load": 1.0,
        "encoder": 0.05,
    },
}


def until_it_moves(log):
    """A recording up to two seconds of its first trial."""
    trial = next(span for span in log.spans if span.trial)
    return rows_left(log, np.arange(log.samples) < trial.start + 2000)


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_the_same_plant_leaves_noise_alone(rig):
    house, log = subject(rig), recorded(rig, 1)
    prepared = house.prepare(log)
    found = {link.name: rms(house.residual(prepared, {}, link.name)) for link in house.links}
    assert found.keys() == QUIET[rig].keys()
    assert {name: value for name, value in found.items() if value > QUIET[rig][name]} == {}


def test_an_effect_shows_in_the_links_that_it_touches_and_in_no_other():
    for rig in ("bench", "knee"):
        house, log = subject(rig), recorded(rig, 1)
        prepared = house.prepare(log)
        before = {link.name: house.residual(prepared, {}, link.name) for link in house.links}
        for effect in house.catalogue:
            values = dict(zip(effect.knobs, effect.starts[0], strict=True))
            touched = {name for key in effect.knobs for name in house.touched(key)}
            moved = {
                name
                for name, was in before.items()
                if not np.array_equal(was, house.residual(prepared, values, name), equal_nan=True)
            }
            assert moved <= touched, (
                f"{rig}: {effect.name} moves {moved - touched}, said to touch {touched}"
            )
            for name in before:
                assert np.array_equal(
                    np.isnan(before[name]), np.isnan(house.residual(prepared, values, name))
                ), f"{effect.name}: {name}"


@pytest.mark.parametrize(
    "beside",
    [
        {},
        {"muscle.strap_compliance_m_n": 3e-5},
        {"sensors.gauge_crosstalk_pa_n": 5.0},
        {"gas.supply_droop_pa_s_kg": 3e8},
    ],
    ids=str,
)
@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_what_is_kept_of_a_recording_is_what_would_be_made_anew(rig, beside):
    house, log = subject(rig), recorded(rig, 1)
    prepared = house.prepare(until_it_moves(log) if beside else log)
    for effect in house.catalogue:
        for link in sorted(
            {name for key in (*effect.knobs, *beside) for name in house.touched(key)}
        ):
            values = {**beside, **dict(zip(effect.knobs, effect.starts[0], strict=True))}
            house.residual(prepared, beside, link)
            found = house.residual(prepared, values, link)
            prepared.cache.clear()
            prepared.residuals.clear()
            assert np.array_equal(found, house.residual(prepared, values, link), equal_nan=True), (
                f"{effect.name}: {link}"
            )


def test_shut_valves_are_taken_a_cycle_at_once_within_a_pascal_s_hundredth():
    house, log = subject("knee"), recorded("knee", 1)
    prepared = house.prepare(log)
    bench = Bench(
        prepared,
        house.params(
            {"gas.leak_per_s": 2e-3, "gas.fill_heating_ratio": 1.3, "gas.heat_exchange_per_s": 3.0}
        ),
    )
    assert 3.0 * prepared.period_s < gas_link.SLOW
    at_once = bench._pressure(0)[0]
    droops = house.params(
        {
            "gas.leak_per_s": 2e-3,
            "gas.fill_heating_ratio": 1.3,
            "gas.heat_exchange_per_s": 3.0,
            "gas.supply_droop_pa_s_kg": 1e-9,
        }
    )
    in_halves = Bench(prepared, droops)._pressure(0)[
        0
    ]  # a droop of nothing: its state still moves, so that cycles are halved
    assert 0.0 < np.max(np.abs(at_once - in_halves)) < 0.05


def test_two_threads_find_what_one_finds():
    house, log = subject("knee"), recorded("knee", 1)
    prepared = house.prepare(log)
    jobs = [
        ({effect.knobs[0]: effect.starts[0][0]}, name)
        for effect in house.catalogue
        for name in house.touched(effect.knobs[0])
    ]
    alone = [
        house.residual(house.prepare(log) if i == 0 else prepared, *job)
        for i, job in enumerate(jobs)
    ]
    with ThreadPoolExecutor(2) as pool:
        both = list(pool.map(lambda job: house.residual(prepared, *job), jobs))
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(alone, both, strict=True))


def test_features_are_as_long_as_residuals_and_finite():
    house, log = subject("knee"), recorded("knee", 1)
    prepared = house.prepare(log)
    for link in house.links:
        residual = house.residual(prepared, {}, link.name)
        for name, values in house.features(prepared, link.name).items():
            assert values.shape == residual.shape and np.isfinite(values).all(), (
                f"{link.name}: {name}"
            )


def test_lost_cycles_are_not_judged_and_spoil_nothing_else():
    from dataclasses import replace

    house, log = subject("bench"), recorded("bench", 1)
    keep = np.ones(log.samples, bool)
    keep[8000:8003] = False
    gappy = replace(
        log,
        cycle=log.cycle[keep],
        columns={name: values[keep] for name, values in log.columns.items()},
    )
    whole, holed = house.prepare(log), house.prepare(gappy)
    for link in house.links:
        a, b = house.residual(whole, {}, link.name), house.residual(holed, {}, link.name)
        assert len(a) == len(b) and np.isnan(b[800])
        assert rms(b) < 1.3 * rms(a), (
            link.name
        )  # the drive's targets in the gap are guessed, and its integral remembers them


def test_heat_of_the_motor_is_switched_by_its_loss_and_its_slow_node_by_its_ratio():
    house, log = subject("bench"), recorded("bench", 1)
    prepared, name = house.prepare(log), "torque_constant_heat"
    problem = Problem(
        house,
        [log],
        {link.name: toy.White(link.name, 1.0) for link in house.links},
        prepared={log.name: prepared},
    )
    knobs = problem.effects[name].knobs
    assert problem.strength(name) == knobs[:1] == ("drive.torque_loss_per_k",)
    assert len({house.touched(key) for key in knobs}) == 1
    plain, timed, slow = (
        house.residual(prepared, dict(zip(knobs, values, strict=True)), "motor")
        for values in ((5e-3, 0.0, 60.0), (5e-3, 0.0, 7.0), (5e-3, 5.0, 7.0))
    )
    assert np.array_equal(plain, timed, equal_nan=True) and not np.array_equal(
        plain, slow, equal_nan=True
    )


def test_the_warmth_of_a_steady_current_is_that_of_both_nodes():
    params = subject("bench").plant.params.copy()
    p = params["drive"][0]
    p["housing_heat_ratio"], p["housing_time_s"], t = 3.0, 20.0, np.arange(1, 60_001) * 1e-3
    out = np.empty(len(t))
    motor_link.warmth(p, np.full(len(t), 2.0), 1e-3, out)
    end = p["winding_thermal_k_w"] * p["winding_ohm"] * 4.0
    assert out == pytest.approx(
        end * (1.0 - np.exp(-t / p["winding_time_s"]) + 3.0 * (1.0 - np.exp(-t / 20.0))),
        abs=2e-4 * end,
    )


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_what_is_kept_of_one_plant_serves_no_other(rig):
    """Every knob on its own, and after the plant without it: the same residuals as with nothing
    kept.
    """
    house, log = subject(rig), recorded(rig, 1)
    prepared = house.prepare(log)
    starts = {
        key: value
        for effect in house.catalogue
        for key, value in zip(effect.knobs, effect.starts[0], strict=True)
    }
    effects = {
        key: dict(zip(effect.knobs, effect.starts[0], strict=True))
        for effect in house.catalogue
        for key in effect.knobs
    }
    for key, knob in house.knobs.items():
        values = {
            **effects.get(key, {}),
            key: starts.get(key, knob.value + 0.5 * (knob.spread or 0.0)),
        }
        for link in house.touched(key):
            house.residual(prepared, {}, link)
            kept = house.residual(prepared, values, link)
            prepared.cache.clear()
            prepared.residuals.clear()
            assert np.array_equal(kept, house.residual(prepared, values, link), equal_nan=True), (
                f"{key} in {link}"
            )
