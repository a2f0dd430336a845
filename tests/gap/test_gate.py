"""The gate: what was promised is held against what a new run of the patched plant file achieves."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from epa_rt.gap.held_out.aside import split
from epa_rt.gap.held_out.gate import GateError, gate
from epa_rt.gap.held_out.shrink import OVERALL, shrinkage
from epa_rt.gap.likelihood.alongside import trials
from tests.gap.damper import NOISE_N, Damper, noise, recorded, white_floor

PLANT = Path(__file__).resolve().parents[2] / "config/plants/bench.yaml"
TRUTH = {"muscle.coulomb_n": 1.0}


@pytest.fixture
def patched(tmp_path):
    path = tmp_path / "patched.yaml"
    path.write_text(PLANT.read_text(encoding="utf-8"), encoding="utf-8")
    return path


def simulator(of_patched):
    """Runs of a rig whose patched file has these values; what it was asked for stands in
    ``asked``.
    """

    def run_again(plant, real, seed):
        run_again.asked.append((plant, seed))
        return Damper().free_run(real, {} if plant == PLANT else of_patched, seed)

    run_again.asked = []
    return run_again


def promise(after):
    return shrinkage(Damper(), [recorded(TRUTH)], {}, after, {"damper": white_floor()})


def test_a_patch_that_does_what_it_promised_passes(patched):
    run_again = simulator(TRUTH)
    found = gate(Damper(), recorded(TRUTH), PLANT, patched, run_again, promise(TRUTH)).report
    assert found["passed"] and abs(found["points"]) < 5.0
    assert found["achieved_share"] == pytest.approx(1.0, abs=0.03)
    assert [plant for plant, _ in run_again.asked[:2]] == [PLANT, patched]
    seeds = [seed for plant, seed in run_again.asked if plant == patched]
    assert len(set(seeds)) == len(seeds) == 5, "each run has noise of its own"


def test_a_file_that_does_less_than_promised_fails(patched):
    found = gate(
        Damper(),
        recorded(TRUTH),
        PLANT,
        patched,
        simulator({"muscle.coulomb_n": 0.5}),
        promise(TRUTH),
    ).report
    assert not found["passed"] and found["points"] == pytest.approx(-25.0, abs=4.0)
    assert found["predicted_share"] == pytest.approx(1.0, abs=0.02)


def test_every_channel_is_told_with_what_was_promised_for_it(patched):
    found = gate(Damper(), recorded(TRUTH), PLANT, patched, simulator(TRUTH), promise(TRUTH)).report
    names = [row["channel"] for row in found["channels"]]
    assert names[0] == OVERALL and "force_n" in names
    row = found["channels"][names.index("force_n")]
    assert (
        row["predicted_share"] == pytest.approx(row["achieved_share"], abs=0.05)
        and row["before"] > 5.0 * row["after"]
    )


def test_what_was_promised_of_the_trial_set_aside_is_held_against_that_trial_alone(patched):
    """The first trial has another gap as well, which the patch leaves there and which is not in the
    one set aside.
    """
    real = recorded(TRUTH)
    first = real.spans[0]
    real.columns["force_n"][first.start : first.stop] += 3.0
    _, part = split(Damper(), [real])
    (aside,) = part.only([real])
    promised = shrinkage(part, [aside], {}, TRUTH, {"damper": white_floor()})
    found = gate(Damper(), real, PLANT, patched, simulator(TRUTH), promised, aside=aside)
    assert found.report["passed"] and found.report["predicted_share"] == pytest.approx(
        1.0, abs=0.02
    )
    assert (found.report["trials"], found.report["of_trials"]) == (1, 2)
    assert all([span.name for span in trials(one)] == ["two"] for one in found[1:]), (
        "what is drawn is of that trial too"
    )
    whole = gate(Damper(), real, PLANT, patched, simulator(TRUTH), promised).report
    assert not whole["passed"] and (whole["trials"], whole["of_trials"]) == (2, 2)


@pytest.mark.parametrize(
    ("real", "words"),
    [({}, "in free run nothing rises above the noise"), (TRUTH, "no figures in free run")],
)
def test_where_nothing_was_to_be_predicted_the_gate_is_not_judged_and_says_why(
    patched, real, words
):
    """No gap in free run, or nothing that was measured in it."""
    promised = (
        [row for row in promise(TRUTH) if row.mode != "free_run"]
        if real
        else shrinkage(Damper(), [recorded({})], {}, {}, {"damper": white_floor()})
    )
    found = gate(Damper(), recorded(real), PLANT, patched, simulator(real), promised).report
    assert found["passed"] is None and found["points"] is None and words in found["not_judged"]
    assert (found["achieved_share"] is None) == (real == {})


def test_where_the_run_shows_no_gap_to_close_that_is_what_is_said(patched):
    found = gate(Damper(), recorded({}), PLANT, patched, simulator({}), promise(TRUTH)).report
    assert (
        found["passed"] is None
        and found["predicted_share"] > 0.9
        and "no gap to close" in found["not_judged"]
    )


def test_a_patched_file_that_does_not_load_is_one_sentence_and_nothing_is_run(patched):
    patched.write_text("plant: bench\ndrive:\n  supply: 48 kg\n", encoding="utf-8")
    run_again = simulator(TRUTH)
    with pytest.raises(GateError, match=r"patched.yaml:3: .*48 kg"):
        gate(Damper(), recorded(TRUTH), PLANT, patched, run_again, ())
    assert not run_again.asked


def test_a_run_that_reaches_no_trial_is_one_sentence(patched):
    def run_again(plant, real, seed):
        return replace(real, spans=(), path="new.mcap")

    with pytest.raises(GateError, match="before its first trial"):
        gate(Damper(), recorded(TRUTH), PLANT, patched, run_again, ())


def test_a_patched_plant_that_trips_on_the_way_is_not_judged_by_the_trials_before(patched):
    inner = simulator(TRUTH)

    def run_again(plant, real, seed):
        run = inner(plant, real, seed)
        return replace(run, spans=run.spans[:2]) if plant != PLANT and seed == 13 else run

    with pytest.raises(GateError, match="found 1 trials of the patched plant, expected the 2 of"):
        gate(Damper(), recorded(TRUTH), PLANT, patched, run_again, promise(TRUTH))


def hunting(of_patched, out_of_step):
    """Runs of a rig whose loop hunts: those of some seeds out of step with the others, and begun a
    cycle later.
    """
    inner = simulator(of_patched)

    def run_again(plant, real, seed):
        run, late = inner(plant, real, seed), int(seed in out_of_step)
        columns = {name: np.roll(values, late) for name, values in run.columns.items()}
        columns["force_n"] = columns["force_n"] + 2.0 * NOISE_N * np.sign(
            np.sin(2.0 * np.pi * np.arange(run.samples) / 200.0 + np.pi * late)
        )
        spans = tuple(
            replace(span, start=span.start + late, stop=min(span.stop + late, run.samples))
            for span in run.spans
        )
        return replace(run, columns=columns, spans=spans)

    return run_again


@pytest.mark.parametrize("out_of_step", [(), (13,), (11, 12), (12, 13, 14, 15)])
def test_a_loop_that_hunts_out_of_step_with_the_log_costs_the_patch_nothing(patched, out_of_step):
    """The log hunts as the runs that begin where it does."""
    real = hunting(TRUTH, ())(patched, recorded(TRUTH), 3)
    found = gate(Damper(), real, PLANT, patched, hunting(TRUTH, out_of_step), promise(TRUTH)).report
    assert found["achieved_share"] == pytest.approx(1.0, abs=0.05)


def test_a_rig_noisier_than_its_plant_file_is_not_held_against_the_patch(patched):
    """The recording's own noise, found in free run, is part of the floor."""
    loud = recorded(TRUTH)
    loud = replace(
        loud,
        columns=loud.columns | {"force_n": loud.columns["force_n"] + 4.0 * noise(loud.samples, 9)},
    )
    rows = [
        replace(row, floor=5.0 * row.floor) if row.channel == "force_n" else row
        for row in promise(TRUTH)
    ]
    found = gate(Damper(), loud, PLANT, patched, simulator(TRUTH), rows).report
    force = next(row for row in found["channels"] if row["channel"] == "force_n")
    assert force["floor"] > 4.0 * NOISE_N and force["achieved_share"] == pytest.approx(1.0, abs=0.2)
