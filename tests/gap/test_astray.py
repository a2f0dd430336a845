"""Intervals that count what a fit of twins shows: what shifts all blocks alike, no scatter of
blocks can tell.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.likelihood.astray import TWINS, astray
from epa_rt.gap.likelihood.intervals import intervals
from epa_rt.gap.likelihood.point import Normal
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import settled
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.subject import Link, Plain
from epa_rt.models.effect import Effect, Knob
from tests.gap import toy

STIFFNESS, FORCE_NOISE_N, SAMPLES = 200.0, 0.05, 4000
KEY = "spring.stiffness_n_m"
Reads = Callable[[np.ndarray, np.random.Generator], np.ndarray]


class Spring(Plain):
    """A spring at a commanded position that is measured by ``reads``; its force is held against
    stiffness times what was read.
    """

    name, rate_hz = "spring", 100.0
    links = (Link("spring", "spring", "force_n", "N", "position to force"),)
    without_stop = False
    nominal = (Knob("spring.preload_n", "N", 1.0, -10.0, 10.0, 0.5),)
    catalogue = (Effect("spring", "spring", "spring", (KEY,), ((100.0,),), "spring", "", ""),)
    knobs = {
        knob.key: knob for knob in (*nominal, Knob(KEY, "N/m", 0.0, 0.0, 1e3, 100.0, "spring"))
    }

    def __init__(self, reads: Reads) -> None:
        self.reads = reads

    def touched(self, key: str) -> tuple[str, ...]:
        return ("spring",)

    def prepare(self, recording: Recording) -> Recording:
        return recording

    def residual(self, prepared: Recording, values: Mapping[str, float], link: str) -> np.ndarray:
        c = prepared.columns
        return (
            c["force_n"]
            - values.get(KEY, 0.0) * c["position_m"]
            - values.get("spring.preload_n", 1.0)
        )

    def free_run(
        self, recording: Recording, values: Mapping[str, float], seed: int | None
    ) -> Recording:
        rng, x = np.random.default_rng(seed), recording.columns["command_m"]
        force = (
            values.get(KEY, 0.0) * x
            + values.get("spring.preload_n", 1.0)
            + FORCE_NOISE_N * rng.standard_normal(len(x))
        )
        return replace(
            recording,
            name="twin",
            columns={"command_m": x, "position_m": self.reads(x, rng), "force_n": force},
        )


def noisy(x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return x + 4e-3 * rng.standard_normal(len(x))


def scaled(x: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return x * (1.0 + 0.01 * rng.standard_normal())


def fitted(reads: Reads, seed: int = 1):
    subject, t = Spring(reads), np.arange(SAMPLES) / 100.0
    blank = Recording(
        "log",
        "",
        "spring",
        "",
        "",
        0.01,
        np.arange(SAMPLES),
        {"command_m": 0.02 * np.sin(2.0 * np.pi * 0.31 * t)},
        (Span("one", 0, SAMPLES, True),),
    )
    data = replace(
        subject.free_run(blank, {KEY: STIFFNESS, "spring.preload_n": 1.1}, seed), name="log"
    )
    misfit = (
        np.var(subject.residual(data, {KEY: STIFFNESS, "spring.preload_n": 1.1}, "spring"))
        / FORCE_NOISE_N**2
    )
    problem = Problem(
        subject, [data], {"spring": toy.White("spring", FORCE_NOISE_N)}, {"spring": misfit}
    )
    return problem, settled(problem, ("spring",))


def ends(problem, point, off) -> tuple[float, float]:
    by = intervals(point.normal, (KEY,), off)[KEY] * problem.spread(KEY)
    return point.values[KEY] - by, point.values[KEY] + by


def test_noise_of_a_measured_input_makes_stiffness_small_and_the_interval_says_so():
    problem, point = fitted(noisy)
    assert ends(problem, point, None)[1] < STIFFNESS
    low, high = ends(problem, point, astray(problem, point))
    assert low < STIFFNESS < high
    assert 0.5 * (high - low) < 3.0 * (STIFFNESS - point.values[KEY])


def test_what_shifts_a_whole_recording_makes_the_interval_wide_enough():
    held = {False: 0, True: 0}
    for seed in range(12):
        problem, point = fitted(scaled, 100 + seed)
        for twins in held:
            low, high = ends(problem, point, astray(problem, point, seed) if twins else None)
            held[twins] += low <= STIFFNESS <= high
    assert held[False] < 9 <= held[True]


def test_where_the_method_is_right_the_interval_is_about_that_of_the_blocks():
    problem, point = fitted(lambda x, rng: x)
    plain, twins = ends(problem, point, None), ends(problem, point, astray(problem, point))
    assert 0.99 < (twins[1] - twins[0]) / (plain[1] - plain[0]) < 2.0


def test_same_twins_every_time():
    problem, point = fitted(noisy)
    np.testing.assert_array_equal(astray(problem, point), astray(problem, point))


def test_no_model_of_the_whole_and_no_number_leave_the_interval_of_the_blocks():
    problem, point = fitted(noisy)
    for run in (
        lambda recording, values, seed: None,
        lambda recording, values, seed: _broken(recording),
    ):
        problem.subject.free_run = run
        assert astray(problem, point) is None


def _broken(recording: Recording) -> Recording:
    return replace(recording, columns=recording.columns | {"force_n": np.full(SAMPLES, np.inf)})


def normal(vector: np.ndarray, frozen: bool = False) -> Normal:
    blocks = len(vector)
    return Normal(
        ("a",),
        np.ones((1, blocks, 1, 1)),
        vector.reshape(1, blocks, 1),
        np.ones((1, blocks)),
        np.zeros(1),
        np.zeros(1),
        np.array([frozen]),
    )


def test_interval_by_hand():
    blocks = normal(np.tile([1.0, -1.0], 50))  # 100 blocks of variance 1, one key
    half = 1.96 * 0.1 * np.sqrt(100.0 / 99.0)
    assert intervals(blocks, ("a",))["a"] == pytest.approx(half)
    assert intervals(blocks, ("a",), np.full((TWINS, 1), 0.05))["a"] == pytest.approx(
        half
    )  # less than the blocks say
    assert intervals(blocks, ("a",), np.full((TWINS, 1), 0.5))["a"] == pytest.approx(1.96 * 0.5)
    assert intervals(blocks, ("a",), np.array([[-1.0], [1.0]]))["a"] == pytest.approx(1.96)
    assert intervals(normal(np.ones(4), frozen=True), ("a",), np.ones((TWINS, 1)))["a"] == np.inf


def test_what_is_believed_of_a_nominal_parameter_adds_to_what_twins_show():
    believed = replace(normal(np.tile([1.0, -1.0], 50)), prior=np.array([100.0]))
    assert intervals(believed, ("a",), np.full((TWINS, 1), 0.5))["a"] == pytest.approx(
        1.96 * np.sqrt(0.25 + 100.0 / 200.0**2)
    )


class Whole(toy.Toy):
    """The toy rig with a model of the whole: what it measures of its inputs is exact."""

    def free_run(self, recording, values, seed):
        rng = np.random.default_rng(seed)
        channels = {"drive": "current_a", "gas": "pressure_pa", "spring": "force_n"}
        clean = dict(recording.columns)
        for link in ("gas", "drive", "spring"):
            clean[channels[link]] = toy.predicted(clean, values, link)
        noise = {
            channels[link]: size * rng.standard_normal(recording.samples)
            for link, size in toy.NOISE.items()
            if seed is not None
        }
        return replace(
            recording,
            columns={name: values + noise.get(name, 0.0) for name, values in clean.items()},
        )


def test_diagnosis_takes_twins_where_there_is_a_model_of_the_whole():
    data = [toy.recording("log", 101, {"drive.coulomb_a": 0.02}, seconds=20.0)]
    plain, whole = (
        diagnose(subject, data, floors=toy.floors, how_far=False).effects[0].parameters[0]
        for subject in (toy.Toy(), Whole())
    )
    assert plain.value == pytest.approx(whole.value, rel=0.05)
    assert whole.low <= 0.02 <= whole.high


def test_diagnosis_gives_numbers_as_wide_as_its_twins_say(monkeypatch):
    monkeypatch.setattr(
        "epa_rt.gap.diagnose.astray",
        lambda problem, point, seed: np.full((TWINS, len(point.normal.keys)), 0.05),
    )
    number = (
        diagnose(
            toy.Toy(),
            [toy.recording("log", 101, {"drive.coulomb_a": 0.02}, seconds=20.0)],
            floors=toy.floors,
            how_far=False,
        )
        .effects[0]
        .parameters[0]
    )
    assert number.high - number.value == pytest.approx(
        1.96 * 0.05 * toy.KNOBS["drive.coulomb_a"].spread, rel=1e-3
    )
