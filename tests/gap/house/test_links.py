"""Links without a gap leave noise alone, with a gap more, and the same whatever thread asks."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from tests.gap.house.runs import recorded, rms, subject

# rms that a rig without a gap may leave: converters' steps and noise, through the low-pass
QUIET = {
    "bench": {"drive": 4e-3, "motor": 3e-3, "torque": 2e-4, "gas0": 200.0, "muscle0": 0.12, "encoder": 0.05},
    "knee": {"drive": 12e-3, "motor": 4e-3, "torque": 2e-4, "gas0": 200.0, "gas1": 200.0, "muscle0": 0.13, "load": 1.0, "encoder": 0.05},
}


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
            moved = {name for name, was in before.items() if not np.array_equal(was, house.residual(prepared, values, name), equal_nan=True)}
            assert moved <= touched, f"{rig}: {effect.name} moves {moved - touched}, said to touch {touched}"
            for name in before:
                assert np.array_equal(np.isnan(before[name]), np.isnan(house.residual(prepared, values, name))), f"{effect.name}: {name}"


def test_two_threads_find_what_one_finds():
    house, log = subject("knee"), recorded("knee", 1)
    prepared = house.prepare(log)
    jobs = [({effect.knobs[0]: effect.starts[0][0]}, name) for effect in house.catalogue for name in house.touched(effect.knobs[0])]
    alone = [house.residual(house.prepare(log) if i == 0 else prepared, *job) for i, job in enumerate(jobs)]
    with ThreadPoolExecutor(2) as pool:
        both = list(pool.map(lambda job: house.residual(prepared, *job), jobs))
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(alone, both, strict=True))


def test_features_are_as_long_as_residuals_and_finite():
    house, log = subject("knee"), recorded("knee", 1)
    prepared = house.prepare(log)
    for link in house.links:
        residual = house.residual(prepared, {}, link.name)
        for name, values in house.features(prepared, link.name).items():
            assert values.shape == residual.shape and np.isfinite(values).all(), f"{link.name}: {name}"


def test_lost_cycles_are_not_judged_and_spoil_nothing_else():
    from dataclasses import replace

    house, log = subject("bench"), recorded("bench", 1)
    keep = np.ones(log.samples, bool)
    keep[8000:8003] = False
    gappy = replace(log, cycle=log.cycle[keep], columns={name: values[keep] for name, values in log.columns.items()})
    whole, holed = house.prepare(log), house.prepare(gappy)
    for link in house.links:
        a, b = house.residual(whole, {}, link.name), house.residual(holed, {}, link.name)
        assert len(a) == len(b) and np.isnan(b[800])
        assert rms(b) < 1.3 * rms(a), link.name  # the drive's targets in the gap are guessed, and its integral remembers them
