"""What the noise of readings leaves of a model: a motion that is read a little wrong turns over a
little early or late, and dry friction jumps there.
"""

from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap.likelihood.floor import floors, white
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.reading_noise import ReadingNoise
from epa_rt.gap.posterior.views import Seen, View, on_ground
from tests.gap.foreign.carriages import opened
from tests.gap.foreign.test_reversals import CART, PLACE_M
from tests.gap.foreign.test_reversals import PLANT as CARRIAGE_PLANT
from tests.gap.foreign.test_reversals import RIG as CARRIAGE_RIG
from tests.gap.foreign.test_strange_pistons import PLANT, RIG, stroked

READ_N = 0.05  # deviation of the floor of the force, behind the low-pass


@pytest.fixture
def noise(tmp_path):
    subject = opened(tmp_path, RIG, PLANT)
    floors = {"force": white("force", READ_N, "sensors")}
    return ReadingNoise(Problem(subject, [stroked(1), stroked(2)], floors), {})


def test_it_grows_with_the_friction_that_jumps_at_a_reversal(noise):
    found = [
        noise.per_sample({"friction.coulomb_n": force})["force"].mean
        for force in (0.0, 3.0, 6.0, 12.0)
    ]
    assert found == sorted(found) and found[-1] > 2.0 * found[0] >= 2.0
    square = [one - found[0] for one in found[1:]]
    assert square[2] / square[1] == pytest.approx(4.0, rel=0.3)


def test_it_is_what_a_true_model_leaves_beyond_its_output_s_noise(tmp_path, noise):
    """The friction that is there, told: what is left of the recordings is what was foreseen."""
    subject = opened(tmp_path, RIG, PLANT)
    floors = {"force": white("force", READ_N, "sensors")}
    problem = Problem(subject, [stroked(1, 8.0), stroked(2, 8.0)], floors)
    true = {"piston.area_m2": 3.06e-4, "friction.viscous_n_s_m": 22.0, "friction.coulomb_n": 8.0}
    left = problem.residual(true, "force")
    foreseen = ReadingNoise(problem, {}).per_sample(true)["force"].mean
    assert np.mean(left**2) == pytest.approx(foreseen, rel=0.5)


def test_a_rig_that_reads_no_motion_again_has_none(noise, monkeypatch):
    problem = noise._problem
    monkeypatch.setattr(type(problem.subject), "read_again", lambda *_: None)
    found = ReadingNoise(problem, {}).per_sample({"friction.coulomb_n": 9.0})
    assert found == {"force": (1.0, 0.0, 0.0)}


def test_what_a_model_filters_off_of_the_noise_explains_nothing(tmp_path):
    """A spring in front of half the mass lets less of an encoder's noise through."""
    cart = opened(tmp_path, CARRIAGE_RIG, CARRIAGE_PLANT)
    read = replace(CART, place_noise_m=1e-5)
    log = read.driven("log", PLACE_M, np.random.default_rng(1), coulomb_n=24.0)
    problem = Problem(cart, [log], floors(cart, [log], {}))
    spring = {"drive.coupling_lag_s": 0.01, "drive.coupling_damping_ratio": 0.3}
    noise = ReadingNoise(problem, {})
    assert noise.per_sample({})["force"].filtered == 0.0
    bare, taken = noise._bare["force"], noise.per_sample(spring)["force"].filtered
    assert 0.3 * bare < taken < bare


def test_noise_is_one_for_all_models():
    """Else a model would be excused by the noise that it makes itself."""
    bare, least = Seen(noise=80.0, chi=300.0), Seen(noise=90.0, chi=120.0)
    noisy = {"blocks": View({"force": Seen(noise=200.0, chi=210.0)})}
    on = on_ground(noisy, {("blocks", "force"): least}, {"blocks": View({"force": bare})})
    assert on["blocks"].links["force"].excess == 120.0
    more = {"blocks": View({"force": Seen(noise=100.0, chi=300.0)})}
    on = on_ground(noisy, {("blocks", "force"): least}, more)
    assert on["blocks"].links["force"].excess == 110.0
    below = Seen(noise=90.0, chi=60.0)
    on = on_ground(noisy, {("blocks", "force"): below}, {"blocks": View({"force": bare})})
    assert on["blocks"].links["force"].excess == 150.0
