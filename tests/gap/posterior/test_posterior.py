"""The posterior over sets of effects: on a made-up rig whose truth is known, and its formula."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.likelihood.reading_noise import ReadingNoise
from epa_rt.gap.likelihood.refit import settled
from epa_rt.gap.likelihood.screen import Pair, Signature
from epa_rt.gap.likelihood.start import Start, at_base
from epa_rt.gap.posterior.answer import table_for
from epa_rt.gap.posterior.evidence import (
    START,
    TAILS,
    Formula,
    log_likelihood,
    of_size,
    strain,
    usual_strain,
)
from epa_rt.gap.posterior.prior import Prior
from epa_rt.gap.posterior.search import BEYOND_PROMISE, Model, Search, Table, chi_left
from epa_rt.gap.posterior.unknown import inclusion, posterior
from epa_rt.gap.posterior.views import BLOCKS, FREE_RUN, Seen, View, blocks
from tests.gap import toy

OFF = {"drive.gain_a": 1.02, "spring.stiffness_n_m": 915.0, "gas.flow_pa_s": 4.1e5}


def found(values=None, extra=None, without=(), count=2):
    logs = [
        toy.recording(f"log{i}", 10 + i, OFF | (values or {}), extra=extra, seconds=20.0)
        for i in range(count)
    ]
    aside = [toy.recording("aside", 40, OFF | (values or {}), extra=extra, seconds=20.0)]
    problem, base, left = at_base(toy.Toy(), logs, without, floors=toy.floors)
    table = table_for(Start(problem, base, left, None), aside, None, START)
    return table, posterior(table, START)


def begun(values, numbers=START):
    """A problem, its base and a search of it that has fitted nothing but the base."""
    logs = [toy.recording(f"log{i}", 10 + i, OFF | values) for i in range(2)]
    problem, base, left = at_base(toy.Toy(), logs, floors=toy.floors)
    families = {name: effect.family for name, effect in problem.effects.items()}
    search = Search(problem, base, left, None, None, Formula(Prior(families), numbers))
    return problem, base, search


@pytest.fixture(scope="module")
def short_problem():
    """A problem of one short log, and the noise of its readings."""
    problem, *_ = at_base(
        toy.Toy(), [toy.recording("log", 10, OFF, seconds=4.0)], floors=toy.floors
    )
    return problem, ReadingNoise(problem, {})


def test_spreads_from_few_runs_forbid_less_than_those_from_many():
    def costs(runs: int, z: list[float], own: float = 0.0) -> float:
        nominal = np.array([True] * len(z) + [False])
        return -strain(View({}, ("",) * (len(z) + 1), np.array([*z, own]), nominal, runs, ~nominal))

    assert costs(3, [4.0]) < costs(20, [4.0]) < 0.5 * 4.0**2
    assert costs(20, [4.0, 4.0]) > costs(20, [4.0]) > costs(20, [2.0]) > costs(20, [0.0]) == 0.0
    assert costs(10**6, [2.0]) == pytest.approx(0.5 * 2.0**2, rel=1e-3)  # known: a Gaussian
    assert costs(20, [0.0], own=12.0) > costs(20, [0.0], own=1.0) > 0.0


@pytest.mark.parametrize(("runs", "count"), [(0, 1), (0, 5), (4, 3), (20, 3)])
def test_where_the_plant_file_is_right_nominal_parameters_cost_what_they_usually_do(runs, count):
    random, draws = np.random.default_rng(7), (100_000, count)
    tails = runs - 1.0 if runs else TAILS
    # of one Student's t together where runs have measured them, each of its own where a file has
    scatter = random.chisquare(tails, (draws[0], 1 if runs else count)) / tails
    z = random.standard_normal(draws) / np.sqrt(scatter)
    view = View({}, ("",) * count, z, np.ones(count, bool), runs, np.zeros(count))
    one = replace(view, z=z[0])
    assert np.mean(strain(view)) == pytest.approx(usual_strain(one), rel=0.02)


@pytest.mark.parametrize("known", [0.3, 1.0, 7.0])
def test_what_is_known_of_a_number_is_a_prior_and_no_fine(known):
    """However well a calibration knows an error, all its sizes together are as probable."""

    def density(known: float) -> np.ndarray:
        one, own = np.linspace(-400.0, 400.0, 400_001)[:, None], np.array([False])
        return np.exp(strain(View({}, ("a",), one, own, known=np.array([known]))))

    z, probable = np.linspace(-400.0, 400.0, 400_001), density(known)
    assert np.trapezoid(probable, z) == pytest.approx(np.trapezoid(density(1.0), z), rel=1e-4)
    # five stated deviations are improbable, and not impossible
    assert 1e-4 < np.interp(5.0 / known, z, probable) / np.interp(0.0, z, probable) < 0.02


def test_beyond_a_typical_strength_every_decade_is_as_probable():
    size = np.geomspace(1e-3, 1e5, 80_001)
    mass = np.exp([of_size(one) for one in size]) * size  # over the logarithm of size

    def of(low: float, high: float) -> float:
        some = (size >= low) & (size <= high)
        return float(np.trapezoid(mass[some], np.log(size[some])))

    assert of(100.0, 1e3) == pytest.approx(of(1e3, 1e4), rel=0.01)
    assert 0.5 * of(100.0, 1e3) < of(1.0, 10.0) < of(100.0, 1e3)
    assert of(0.0, 0.1) < 0.1


@given(
    size=st.floats(0.01, 30.0),
    effect=st.sampled_from(["motor_friction", "force_gain", "current_offset", "hardening"]),
    sign=st.sampled_from([1.0, -1.0]),
)
def test_the_size_of_an_effect_is_in_typical_strengths(short_problem, size, effect, sign):
    problem, noise = short_problem
    ((key, typical),) = problem.typical(effect).items()
    values = {key: problem.knobs[key].value + sign * size * typical}
    view = blocks(problem, noise, (effect,), values)
    assert view.sizes == {effect: pytest.approx(size)}


@pytest.mark.parametrize(("stated_n", "typical_n"), [(0.0, 2.0), (1.99, 2.0), (8.0, 8.0)])
def test_a_guess_of_the_plant_file_goes_wrong_by_a_typical_strength_or_its_own(
    short_problem, monkeypatch, stated_n, typical_n
):
    problem, _ = short_problem
    guessed = problem.knobs["spring.coulomb_n"]._replace(value=stated_n, absent=0.0)
    monkeypatch.setattr(problem, "knobs", {**problem.knobs, "spring.coulomb_n": guessed})
    assert problem.typical("coulomb") == {"spring.coulomb_n": typical_n}


def test_what_an_effect_does_at_thirty_typical_strengths_another_more_often_does_at_its_own():
    def model(effect: str, size: float) -> Model:
        keys, z, own = (effect,), np.array([1.0]), np.array([False])
        view = View({"a": Seen(100.0, 110.0, np.eye(1))}, keys, z, own, sizes={effect: size})
        return Model((effect,), {BLOCKS: view}, {})

    none = Model((), {BLOCKS: View({"a": Seen(100.0, 1e5)})}, {})
    families = {"zero": "zero", "drift": "drift"}
    table = Table((none, model("zero", 30.0), model("drift", 1.0)), Prior(families))
    (best, share), (_, other), *_ = posterior(table, START).models
    assert best.effects == ("drift",)
    assert share / other == pytest.approx(31.0 / 2.0, rel=1e-6)
    saved = Formula(table.prior, START).without
    assert saved(model("zero", 30.0), "zero") - saved(model("zero", 0.0), "zero") == pytest.approx(
        np.log(31.0)
    )


def test_a_rig_without_a_gap_has_most_probably_none():
    _, answer = found()
    assert answer.models[0][0].effects == () and answer.models[0][1] > 0.5
    assert answer.unknown < 0.3


def test_an_effect_that_stood_for_another_is_exchanged_for_it():
    problem, _, search = begun({"drive.coulomb_a": 0.05, "gas.delay_s": 0.01})
    wrong = ("hardening", "motor_friction")
    search._model(wrong, settled(problem, wrong).values, None)
    search._doubted()
    best = max(search.models, key=search._evidence)
    assert set(best.effects) == {"motor_friction", "valve_delay"}


def test_a_set_is_judged_at_its_own_optimum_before_one_effect_more_is_named_beside_it():
    """Else the effect has the merit of the better fit."""
    problem, base, search = begun({"drive.coulomb_a": 0.05})
    alone, both = ("motor_friction",), ("motor_friction", "valve_delay")
    stopped_early = {**base.values, "drive.coulomb_a": 0.047}
    before = search._model(alone, stopped_early, None)
    more = search._model(both, settled(problem, both, stopped_early).values, None)
    assert search._evidence(more) > search._evidence(before)
    search._without(more, "valve_delay")
    after = search._of(alone)
    assert after.values["drive.coulomb_a"] == pytest.approx(0.05, rel=0.02)
    assert search._evidence(after) > search._evidence(more)


def test_from_the_least_share_on_one_effect_more_may_count():
    _, _, search = begun({"drive.coulomb_a": 0.05}, replace(START, further_odds=-8.0))
    known = ("leak",)
    search._model(known, settled(search._problem, known).values, None)
    share = search._least_share(known, (BLOCKS,)) * BEYOND_PROMISE

    def evidence(share: float) -> float:
        return search._with_one_more(search._of(known), (BLOCKS,), left=1.0 - share)

    assert 0.0 < share < 1.0
    assert not search._hopeful(evidence(0.9 * share)) and search._hopeful(evidence(1.1 * share))
    assert search._least_share(known, ()) == np.inf  # in no view there is anything to explain


def test_a_set_that_is_proposed_once_more_keeps_what_free_run_has_shown():
    problem, base, search = begun({"drive.coulomb_a": 0.05, "gas.delay_s": 0.01})
    pair = ("valve_delay", "motor_friction")
    search._model(("motor_friction",), settled(problem, ("motor_friction",)).values, None)
    poor = search._model(pair, base.values, None)
    search._found[frozenset(pair)] = replace(poor, views={**poor.views, FREE_RUN: View({})})
    assert pair[::-1] in search._proposed_by_blocks(("motor_friction",))
    better = search._found[frozenset(pair)]
    assert FREE_RUN in better.views
    assert chi_left(better) < chi_left(poor) and better.values != poor.values


@pytest.mark.parametrize("before", [("valve_delay",), ("valve_delay", "motor_friction")])
def test_a_pair_leads_those_that_stopped_short_to_its_own_optimum(before):
    problem, base, search = begun({"drive.coulomb_a": 0.05, "gas.delay_s": 0.01})
    stopped_short = search._model(before, base.values, None)

    class Proposed:
        def hidden_pair(self, families, on):
            seen = [
                Signature(name, dict(zip(effect.knobs, effect.starts[0], strict=True)), 1, 1, 1, 1)
                for name, effect in problem.effects.items()
                if name in ("motor_friction", "valve_delay")
            ]
            return Pair((seen[0], 0.3), (seen[1], 0.3), 1.0)

    assert set(search._hidden_pair(problem, base, Proposed())) == {"motor_friction", "valve_delay"}
    assert chi_left(search._of(before)) < chi_left(stopped_short)
    assert search._of(before).values["gas.delay_s"] == pytest.approx(0.01, rel=0.05)


@pytest.mark.parametrize(
    ("values", "effects"),
    [
        ({"spring.cubic_n_m3": -2e5}, {"hardening"}),
        ({"drive.coulomb_a": 0.05, "gas.delay_s": 0.01}, {"motor_friction", "valve_delay"}),
    ],
)
def test_what_a_rig_has_is_most_probable(values, effects):
    _, answer = found(values)
    (model, share), *_ = answer.models
    assert set(model.effects) == effects and share > 0.9
    assert sum(share for _, share in answer.models) + answer.unknown == pytest.approx(1.0)


def test_a_law_in_other_words_is_its_family():
    table, answer = found(extra=lambda c: {"spring": np.sign(c["speed_m_s"])})
    shares = inclusion(answer, table.families)
    assert max(shares, key=shares.get) == "friction"
    assert shares["friction"] > 0.9 * (1.0 - answer.unknown)


def test_what_the_catalogue_lacks_names_nothing_with_confidence():
    table, answer = found(
        {"spring.dahl_n": 1.0, "spring.dahl_m": 3e-3}, without=("dahl", "coulomb")
    )
    assert max(inclusion(answer, table.families).values(), default=0.0) < 0.8
    assert answer.unknown > 0.2


def diagnosed(values=None, **how):
    logs = [toy.recording(f"log{i}", 10 + i, OFF | (values or {}), seconds=20.0) for i in range(2)]
    aside = [toy.recording("aside", 40, OFF | (values or {}), seconds=20.0)]
    return diagnose(toy.Toy(), logs, aside, floors=toy.floors, **how)


def test_the_whole_answer_is_the_posterior_s():
    answer = diagnosed({"drive.coulomb_a": 0.2})
    assert answer.verdict == "explained"
    (effect,) = answer.effects
    assert effect.name == "motor_friction" and effect.confidence > 0.9
    assert effect.confidence == pytest.approx(answer.posterior.families["motor friction"])
    assert effect.parameters[0].low <= 0.2 <= effect.parameters[0].high
    assert answer.says.startswith("Motor friction (") and "of the gap block by block" in answer.says
    row = next(r for r in answer.shrinkage if r.log == "all" and r.channel == "all channels")
    assert row.closed_share > 0.95
    could = answer.posterior
    assert could.models[0].left_share < 0.1 and could.judged_by == BLOCKS
    assert sum(one.probability for one in could.models) + could.unknown > 0.99


def test_no_gap_is_said_with_what_the_logs_could_have_shown():
    answer = diagnosed()
    assert answer.verdict == "no_gap" and not answer.effects
    assert "would have shown at a typical strength" in answer.says


EXCESS = st.floats(0.0, 1e7)


@given(EXCESS, EXCESS, st.floats(1.0, 30.0))
def test_less_left_is_never_less_likely(one, other, freedom):
    def of(excess):
        return log_likelihood(View({"a": Seen(100.0, 100.0 + excess)}), freedom, 0.0)

    assert (of(one) >= of(other)) == (one <= other) or abs(one - other) < 1e-6 * max(1.0, abs(one))


@given(st.floats(1e3, 1e7), st.floats(1e-4, 0.5), st.floats(1.0, 30.0))
def test_a_part_that_is_left_counts_alike_on_a_large_gap_and_on_a_larger_one(gap, part, freedom):
    """Where what is left is well above the noise."""

    def ahead(total):
        left, all_of_it = (View({"a": Seen(0.0, chi)}) for chi in (part * total, total))
        return log_likelihood(left, freedom, 0.0) - log_likelihood(all_of_it, freedom, 0.0)

    if part * gap > 1e3 * freedom:
        assert ahead(10.0 * gap) == pytest.approx(ahead(gap), rel=1e-2)


@given(st.floats(0.0, 100.0), st.floats(0.0, 100.0))
def test_a_nominal_parameter_that_is_further_off_costs_more_and_is_not_forbidden(one, other):
    def cost(z):
        return -strain(View({}, ("a",), np.array([z]), np.array([True])))

    assert (cost(one) <= cost(other)) == (one <= other) or one == pytest.approx(other)
    assert cost(100.0) < 25.0


@given(EXCESS)
def test_what_is_within_the_uncertainty_of_a_floor_counts_for_little(noise):
    """A tenth of what the floor may be wrong by, on a link of any length."""
    view = View({"a": Seen(noise, noise + 0.1 * 0.02 * noise)})
    assert -0.1 * 6.0 <= log_likelihood(view, 6.0, 0.02) <= 0.0


@given(st.permutations(range(4)))
def test_the_order_of_models_changes_nothing(order):
    models = [
        Model((), {BLOCKS: View({"a": Seen(10.0, 400.0)})}, {}),
        *(
            Model((name,), {BLOCKS: View({"a": Seen(10.0, chi)})}, {})
            for name, chi in (("x", 20.0), ("y", 50.0), ("z", 300.0))
        ),
    ]
    families = {name: name for name in "xyz"}
    table = Table((models[0], *(models[i] for i in order if i)), Prior(families))
    assert posterior(table, START).models[0][0].effects == ("x",)


def test_a_law_that_the_plant_file_has_shares_its_odds_with_no_other_and_makes_no_set_larger():
    families = {"coulomb": "friction", "dahl": "friction", "seal": "friction", "leak": "leak"}
    further = START.further_odds

    def log(*effects: str, in_plant: tuple[str, ...] = (), measured: bool = False) -> float:
        return Prior(families, in_plant, measured).log_odds(effects, further)

    assert log("dahl", in_plant=("coulomb",)) == pytest.approx(log("leak") - np.log(2.0))
    for own in (("coulomb",), ("coulomb", "seal")):  # shared among themselves
        assert log("coulomb", in_plant=own) == pytest.approx(-np.log(len(own)))
    both = log("coulomb", "leak", in_plant=("coulomb",))
    assert both == pytest.approx(log("coulomb", in_plant=("coulomb",)) + log("leak"))
    guesses = log("coulomb", "seal", in_plant=("coulomb", "seal"))  # each for itself
    assert guesses == pytest.approx(-2.0 * np.log(2.0))
    # healthy runs have measured the plant: it changes as seldom as anything sets in
    since = {"in_plant": ("coulomb",), "measured": True}
    assert log("coulomb", **since) == pytest.approx(log("leak"))
    assert log("coulomb", "leak", **since) == pytest.approx(further)  # the one set of two


@given(
    own=st.sets(st.sampled_from("abcd")),
    of=st.sets(st.sampled_from("abcd")),
    measured=st.booleans(),
)
def test_one_effect_more_costs_what_the_prior_of_the_larger_set_says(own, of, measured):
    prior = Prior({name: name for name in "abcd"}, tuple(sorted(own)), measured)
    further, here = START.further_odds, tuple(sorted(of))
    larger = [prior.log_odds((*here, one), further) for one in "abcd" if one not in of]
    best = max(larger, default=-np.inf) - prior.log_odds(here, further)
    assert prior.log_of_one_more(here, further) == pytest.approx(best)
