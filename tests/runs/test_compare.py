"""Two runs side by side: alike where only chance differs, and what was changed where it was."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.cli.main import main
from epa_rt.report.run import Run
from epa_rt.runs.compare import NothingInCommon, compare
from epa_rt.runs.compare_words import as_text, verdict
from epa_rt.runs.noise import block_noise, blocks_of, rounding, sample_noise, step_of


def changed(run: Run, name: str, change) -> Run:
    """The run with one signal changed: ``change(t_s, values)``."""
    values = change(run.t_s, run.signals[name].copy())
    return dataclasses.replace(run, signals=run.signals | {name: values})


def test_a_run_with_itself_differs_in_nothing(runs, logs, capsys):
    found = compare(runs["first"], runs["first"])
    assert found.identical and not found.is_different and found.first is None
    assert not found.set_up and not found.asked
    assert main(["compare", str(logs["first"]), str(logs["first"])]) == 0
    assert "bit for bit" in capsys.readouterr().out


def test_another_seed_of_the_noise_differs_in_nothing(runs):
    for one, other in (("first", "other"), ("other", "first")):
        found = compare(runs[one], runs[other])
        assert not found.identical and not found.is_different
        assert not found.differences and not found.asked, as_text(found)
        assert any("seed" in what for what, _ in found.set_up)


def test_a_leak_is_found_by_its_pressure_and_since_when(runs):
    found = compare(runs["first"], runs["leaking"])
    first = found.first
    assert (first.signal, first.kind, first.trial) == ("muscle_pressure_pa", "drift", 1)
    # 0.001 1/s of 460 kPa gauge, seen against the start of the trial; it leaks from there on
    assert first.since_s <= 1.0 and first.beyond_s > first.since_s
    assert -4.0 * 600.0 < first.largest < -4.0 * 300.0
    assert ("plant.yaml differs", ("+effects:", "+  leak:", "+    leak: 0.001 1/s")) in [
        (what, tuple(line for line in lines if line != "+")) for what, lines in found.set_up
    ]
    assert not compare(runs["leaking"], runs["leaking"]).differences


@pytest.mark.parametrize(
    ("name", "size"),
    [("muscle_force_n", 2.0), ("muscle_pressure_pa", 6e3), ("motor_travel_m", -2e-4)],
)
def test_a_step_in_one_reading_is_found_where_it_begins(runs, name, size):
    other = runs["other"]
    (trial,) = other.trials
    at_s = float(other.t_s[trial.begin]) + 1.5
    stepped = changed(other, name, lambda t_s, values: values + size * (t_s >= at_s))
    found = compare(runs["first"], stepped)
    own = [one for one in found.differences if one.trial == 1 and one.kind == "offset"]
    assert {one.signal for one in found.differences} == {name}
    assert own[0].since_s == pytest.approx(1.5, abs=0.25)
    assert own[0].largest == pytest.approx(size, rel=0.5)


def test_a_gain_is_found_and_a_reading_that_is_gone(runs):
    louder = changed(runs["other"], "muscle_force_n", lambda _, values: 1.1 * values)
    first = compare(runs["first"], louder).first
    assert (first.signal, first.kind, first.trial) == ("muscle_force_n", "offset", 1)

    def gone(t_s, values):
        (trial,) = runs["other"].trials
        values[trial.begin + 1000 : trial.begin + 1600] = np.nan
        return values

    first = compare(runs["first"], changed(runs["other"], "motor_current_a", gone)).first
    assert (first.signal, first.kind) == ("motor_current_a", "missing")
    assert first.since_s == pytest.approx(1.0, abs=0.15)
    assert "has no value" in as_text(
        compare(runs["first"], changed(runs["other"], "motor_current_a", gone))
    )


def test_a_sensor_that_became_noisier_is_found(runs):
    random = np.random.default_rng(1)

    def louder(_, values):
        return values + 1.0 * random.standard_normal(len(values))  # N, beside 0.3 N

    found = compare(runs["first"], changed(runs["other"], "muscle_force_n", louder))
    assert {(one.signal, one.kind) for one in found.differences} == {("muscle_force_n", "noise")}
    (trial,) = (one for one in found.differences if one.trial == 1)
    assert trial.largest == pytest.approx(np.hypot(1.0, 0.31) - 0.31, rel=0.15)


def test_another_command_is_said_to_have_been_asked_for(runs):
    asked = changed(runs["other"], "ref_motor_travel_m", lambda _, values: values + 1e-3)
    found = compare(runs["first"], asked)
    assert not found.differences
    assert {one.signal for one in found.asked} == {"ref_motor_travel_m"}


def test_runs_that_went_on_otherwise_are_different(runs):
    ended = dataclasses.replace(runs["other"], outcome="tripped", cause="too hot")
    found = compare(runs["first"], ended)
    assert found.is_different and not found.differences
    assert "tripped (too hot)" in as_text(found)
    state = runs["other"].cycle["state"].copy()
    state[runs["other"].phases[-1].begin :] = 0
    cut = dataclasses.replace(runs["other"], cycle=runs["other"].cycle | {"state": state})
    found = compare(runs["first"], cut)
    assert found.only_a == ("vent",) and found.is_different


def test_logs_without_anything_in_common_get_one_sentence(runs, logs, tmp_path, capsys):
    nothing = dataclasses.replace(runs["other"], signals={})
    with pytest.raises(NothingInCommon, match="found no signal that both have"):
        compare(runs["first"], nothing)
    other = tmp_path / "text.mcap"
    other.write_text("no log")
    assert main(["compare", str(logs["first"]), str(other)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "expected an MCAP log" in said


def test_imported_logs_are_compared_without_a_rig_file(tmp_path, capsys):
    """100 Hz, noise of 0.05 mm; the third lies 0.5 mm higher from 7 s on."""
    (tmp_path / "m.yaml").write_text(
        "mapping: two\nrig: two\nformat: {kind: csv}\nclock: {rate: 100 Hz}\n"
        "measured: {x_position_m: {column: x, unit: mm}}\n"
    )
    for seed, name in enumerate("abc"):
        values = 10.0 + 0.05 * np.random.default_rng(seed).standard_normal(2000)
        values[700:] += 0.5 * (name == "c")
        (tmp_path / f"{name}.csv").write_text("x\n" + "".join(f"{x:.4f}\n" for x in values))
        words = ["import", "m.yaml", f"{name}.csv", "-o", f"{name}.mcap"]
        assert main([w if w in ("import", "-o") else str(tmp_path / w) for w in words]) == 0
    a, b, c = (str(tmp_path / f"{name}.mcap") for name in "abc")
    assert main(["compare", a, b]) == 0
    assert main(["compare", a, c]) == 1
    said = capsys.readouterr().out
    assert "nothing is allowed for valves" in " ".join(said.split())
    assert "X position of B lies up to 0.5" in said and "from 7.0 s" in said


def test_page_and_json_say_the_same(logs, tmp_path, capsys):
    page, answer = tmp_path / "c.html", tmp_path / "c.json"
    words = ["compare", logs["first"], logs["leaking"], "--html", page, "--json", answer]
    assert main([str(word) for word in words]) == 1
    said = capsys.readouterr().out
    assert max(map(len, said.replace(str(tmp_path), "").splitlines())) <= 80
    facts = json.loads(answer.read_text())
    assert facts["schema"] == "epa_rt.compare/1" and facts["different"]
    first = facts["first"]
    assert (first["signal"], first["kind"]) == ("muscle_pressure_pa", "drift")
    assert {"sigma", "step", "unit", "signal"} == set(facts["noise"][0])
    text = page.read_text()
    for words in ("moves to", "plant.yaml differs", "Allan deviation", "muscle pressure, B"):
        assert words in text


def test_verdicts_are_one_sentence(runs):
    for name in ("first", "other", "leaking"):
        text = verdict(compare(runs["first"], runs[name]))
        assert text.endswith(".") and "\n" not in text


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.floats(1e-6, 1e6), st.floats(-10.0, 10.0))
def test_noise_is_recovered_whatever_lasts_beside_it(seed, sigma, offset):
    """Of the difference of two recordings with white noise, an offset and a slow drift."""
    random = np.random.default_rng(seed)
    n, blocks = 100, 300
    shape = np.sin(np.arange(n * blocks) / 5000.0) * 50.0 * sigma
    a, b = (shape + sigma * random.standard_normal(n * blocks) for _ in range(2))
    b += sigma * (offset + np.linspace(0.0, 1.0, len(b)))
    assert sample_noise(a, b) == pytest.approx(sigma, rel=0.1)
    (found,) = block_noise([blocks_of(a, b, n).difference])
    assert found == pytest.approx(sigma * np.sqrt(2.0 / n), rel=0.25)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.0, 2.0))
def test_rounding_bounds_the_ripple_of_a_converters_mean(seed, noise_steps):
    """Means of rounded noisy values, whatever the value: off by no more than is allowed."""
    random = np.random.default_rng(seed)
    step = 0.3
    places = np.linspace(0.0, step, 23)
    noise = step * noise_steps * random.standard_normal((20_000, 1))
    rounded = step * np.round((places + noise) / step)
    off = np.abs(rounded.mean(axis=0) - places - noise.mean())
    seen = sample_noise(rounded[:, 5], np.zeros(20_000)) * np.sqrt(2.0)
    assert off.max() <= rounding(step, seen) + 4.0 * step / np.sqrt(12.0 * 20_000)


def test_the_step_of_a_converter_is_found():
    counts = np.random.default_rng(1).integers(-50, 50, 500)
    assert step_of(0.1 + 0.007 * counts) == pytest.approx(0.007, rel=1e-6)
    assert step_of(np.full(10, 3.0)) == 0.0 and step_of(np.full(3, np.nan)) == 0.0


@pytest.mark.parametrize("step", [1e-300, 1e-3, 1.0, 1e200, 1e300])
def test_rounding_of_any_size_is_at_most_one_count(step):
    for noise in (0.0, 0.1 * step, step, 1e3 * step):
        assert 0.0 <= rounding(step, noise) <= step
    assert rounding(step, 0.0) == step and rounding(step, 3.0 * step) < 1e-6 * step
