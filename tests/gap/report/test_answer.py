"""The same answer as JSON and on the terminal."""

import json
from dataclasses import fields, replace

import jsonschema
import numpy as np
import pytest
from rich.console import Console

from epa_rt.gap.answer.patch import (
    PLANT_DIGEST,
    PatchError,
    check_names,
    check_plant,
    check_values,
    digest_of,
    load_diagnosis,
    patched_text,
)
from epa_rt.gap.diagnosis import Change, Diagnosis, Number
from epa_rt.gap.report.as_json import json_text, schema
from epa_rt.gap.report.gate import gate_words
from epa_rt.gap.report.page import gap_page
from epa_rt.gap.report.terminal import show
from epa_rt.gap.report.words import parameter_words, percent, sigmas, size, times
from tests.gap.damper import Damper
from tests.gap.report.answers import ANSWERS, EXPLAINED, GATE, GONE, NO_GAP, NOT_SEPARABLE, SLIP

ASKED_FOR = {
    "verdict",
    "location",
    "effects",
    "nominal_moved",
    "shrinkage",
    "remainder",
    "next_experiment",
    "seconds",
}


@pytest.mark.parametrize("which", ANSWERS)
def test_the_json_has_every_field_and_fits_its_schema(which):
    data = json.loads(json_text(ANSWERS[which]))
    assert set(data) == {field.name for field in fields(Diagnosis)} >= ASKED_FOR
    jsonschema.validate(data, schema())


def test_the_schema_refuses_what_is_none():
    data = json.loads(json_text(EXPLAINED))
    for wrong in (
        data | {"verdict": "perhaps"},
        data | {"effects": [{"name": "x"}]},
        {k: v for k, v in data.items() if k != "says"},
    ):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(wrong, schema())


def test_no_number_that_is_none_reaches_the_json():
    odd = replace(
        EXPLAINED,
        seconds=float("nan"),
        inputs={"x": [np.float64("inf"), np.arange(2), np.int64(3)]},
    )
    text = json_text(odd)
    assert "NaN" not in text and "Infinity" not in text
    assert json.loads(text)["seconds"] is None and json.loads(text)["inputs"] == {
        "x": [None, [0, 1], 3]
    }


def test_a_diagnosis_comes_back_from_its_json_as_it_was(tmp_path):
    path = tmp_path / "answer.json"
    path.write_text(json_text(EXPLAINED), encoding="utf-8")
    back = load_diagnosis(path)
    assert (
        back.effects == EXPLAINED.effects
        and back.shrinkage == EXPLAINED.shrinkage
        and back.verdict == "explained"
    )


@pytest.mark.parametrize(
    "text, words",
    [
        ("{", "no JSON"),
        ("[]", "expected a diagnosis"),
        ('{"verdict": "perhaps", "says": ""}', "verdict"),
    ],
)
def test_what_is_no_diagnosis_is_one_sentence(tmp_path, text, words):
    path = tmp_path / "answer.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(PatchError, match=words) as error:
        load_diagnosis(path)
    assert "\n" not in str(error.value)


def test_a_patch_holds_every_value_of_the_fit_and_the_effects_names():
    answer = replace(
        EXPLAINED,
        fitted={"muscle.viscous_n_s_m": 5.5, "muscle.coulomb_n": 1.2},
        effects=(replace(SLIP, name="friction"),),
    )
    text = patched_text(answer, Damper())
    assert "5.5" in text and "1.2" in text and "friction" in text


def test_a_patch_for_another_rig_is_refused():
    with pytest.raises(PatchError, match="expected one that the rig damper has"):
        patched_text(EXPLAINED, Damper())


def test_a_patch_for_another_rig_whose_parameters_have_the_same_names_is_refused():
    answer = replace(EXPLAINED, fitted={"muscle.viscous_n_s_m": 5.5}, inputs={"subject": "bench"})
    with pytest.raises(
        PatchError, match="found a diagnosis of the rig bench, expected one of damper"
    ):
        patched_text(answer, Damper())
    assert patched_text(replace(answer, inputs={"subject": "damper"}), Damper())


FRICTION = replace(
    EXPLAINED,
    fitted={"muscle.viscous_n_s_m": 5.5, "muscle.coulomb_n": 1.2},
    effects=(replace(SLIP, name="friction", not_separable_from=()),),
    inputs={"plant": "a.yaml"},
)


@pytest.mark.parametrize("value", [float("nan"), -1e9, 50.1])
def test_a_number_that_the_plant_file_would_not_take_is_refused(value):
    check_values(FRICTION.fitted, Damper())
    with pytest.raises(PatchError, match=r"^muscle.coulomb_n: found .* N, expected 0 to 50 N$"):
        check_values({**FRICTION.fitted, "muscle.coulomb_n": value}, Damper())


def test_an_effect_that_the_rig_cannot_have_is_refused():
    check_names(FRICTION, Damper(), "epa gap catalogue")
    for wrong in (
        replace(SLIP, name="gremlin"),
        replace(SLIP, name="friction", not_separable_from=("gremlin",)),
    ):
        with pytest.raises(
            PatchError,
            match=(
                "found the effect gremlin, expected one of the catalogue of damper .epa gap"
                " catalogue."
            ),
        ):
            check_names(replace(FRICTION, effects=(wrong,)), Damper(), "epa gap catalogue")


def test_a_diagnosis_of_another_plant_file_is_refused_and_one_that_has_been_patched_is_not():
    class Other(Damper):
        knobs = {key: knob._replace(value=knob.value + 0.5) for key, knob in Damper.knobs.items()}

    class Patched(Damper):
        knobs = {
            key: knob._replace(value=FRICTION.fitted[key]) for key, knob in Damper.knobs.items()
        }

    told = replace(FRICTION, inputs=FRICTION.inputs | {PLANT_DIGEST: digest_of(Damper())})
    for fits in (Damper(), Patched()):
        check_plant(told, told.fitted, fits)
    check_plant(FRICTION, FRICTION.fitted, Other())  # an older answer, which does not say
    with pytest.raises(
        PatchError,
        match=(
            "found a diagnosis of the plant file a.yaml, expected one of the plant file that is to"
            " be patched"
        ),
    ):
        check_plant(told, told.fitted, Other())


def shown(diagnosis: Diagnosis) -> str:
    console = Console(
        highlight=False,
        markup=False,
        width=160,
        record=True,
        file=open("/dev/null", "w", encoding="utf-8"),  # noqa: SIM115
    )
    with console.file:
        show(diagnosis, console)
    return console.export_text()


def test_the_terminal_says_first_what_was_found_then_verdict_effect_place_and_share():
    text = shown(NOT_SEPARABLE)
    order = [
        "cycles are missing",
        "NOT SEPARABLE",
        "leak",
        "muscle0_gauge_offset",
        "reversal of muscle speed",
        "all channels",
        "next experiment",
    ]
    assert [text.index(words) for words in order] == sorted(text.index(words) for words in order)
    assert "gate passed" in shown(EXPLAINED) and "99.5 % (98.5 to 100.1)" in shown(EXPLAINED)


def test_a_rig_without_a_gap_shows_no_table_of_effects():
    text = shown(NO_GAP)
    assert "NO GAP" in text and "Confidence" not in text and "Gap closed" not in text


def test_the_terminal_explains_its_figures_in_words():
    text = shown(EXPLAINED)
    assert (
        "standard deviations by which that stands above what noise would give" in text
        and " z " not in text
        and "chi-square" not in text
    )
    assert (
        "> 99" in text
        and "probability that the rig has an effect of its family and the plant file does not"
        in " ".join(text.split())
        and "fed with the commands alone" in text
    )
    assert (sigmas(4.4), sigmas(-2.0), sigmas(99.4), sigmas(87968.0)) == ("4", "0", "> 99", "> 99")


@pytest.mark.parametrize(("source", "said"), [("sensors", True), ("repeats", False)])
def test_a_floor_that_no_run_has_measured_is_said_to_make_sigma_too_high(source, said):
    rows = tuple(replace(row, floor_source=source) for row in EXPLAINED.shrinkage)
    assert ("has measured this floor" in shown(replace(EXPLAINED, shrinkage=rows))) == said


def test_a_number_of_the_plant_file_that_the_logs_say_otherwise_is_said():
    drag = Number("friction.viscous_n_s_m", 246.0, "N*s/m", 240.0, 252.0, 180.0)
    mass = Number("carriage.inertia_kg", 42.1, "kg", 41.0, 43.2, 42.0)
    told = replace(NO_GAP, nominal=(drag, mass))
    text = shown(told)
    assert "friction.viscous_n_s_m from 180.0 to 246.0 N·s/m (240.0 to 252.0)" in text
    assert "carriage.inertia_kg" not in text
    assert all(one.name in gap_page(told) for one in (drag, mass))


def test_with_a_baseline_the_gap_counts_from_the_healthy_runs():
    told = replace(EXPLAINED, changes=(Change("load.mass_kg", "kg", 1.0, 0.1, 2.0, 10.0),))
    for text in (shown(told), gap_page(told)):
        assert "the rig as its healthy runs have it" in " ".join(text.split())
    assert "as its healthy runs" not in shown(EXPLAINED) + gap_page(EXPLAINED)


def test_an_effect_that_the_rig_does_not_have_shows_no_fitted_numbers():
    text = shown(replace(EXPLAINED, effects=(GONE,)))
    assert (
        "braid maxwell slip: in the plant file, not in the rig; the plant file says"
        " muscle0.slip_ratio 0.06000, muscle0.slip_reach_m 2.000 mm" in text
    )
    assert "gone" in text
    assert "0.5000" not in text, "the range of a value on its bound is no interval"


def test_shares_of_the_gate_that_the_noise_decides_are_words():
    def words(before, after, share, floor=1.0):
        return gate_words(
            {"before": before, "after": after, "floor": floor, "achieved_share": share}
        )

    assert words(1.19, 0.8, 1.98) == words(238.0, 160.0, 1.98, 200.0) == "at the floor"
    assert words(1.19, 3.0, -20.0) == "−2000 %", "what the patch makes worse is no noise"
    assert (
        words(1.3, 0.4, 1.74) == "down to the floor"
        and words(5.0, 1.0, 1.0) == "100 %"
        and words(1.0, 0.9, None) == "–"
    )


def test_text_of_a_log_is_not_taken_for_markup():
    assert "[bold]" in shown(replace(NO_GAP, found_first=("a [bold] name",)))


def test_numbers_stand_in_the_units_that_a_person_reads():
    assert (
        size(2500.0, "Pa") == "2.50 kPa"
        and size(67.2, "Pa") == "67.2 Pa"
        and size(0.0045, "A") == "4.50 mA"
    )
    assert size(None, "N") == size(float("nan"), "N") == "–" and size(1.23, "x floor") == "1.2 ×"
    assert (
        times(0.99) == "1.0 ×"
        and times(13.2) == "13 ×"
        and percent(0.997) == "99.7 %"
        and percent(-0.5) == "−50 %"
    )
    assert parameter_words(SLIP.parameters[1]) == ("1.900", "1.600 to 2.200", "2.000", "mm")
    assert parameter_words(Number("rest_ratio", 0.0, "1", -0.1, 0.1, 0.0))[3] == ""


def test_why_a_confidence_is_low_stands_below_the_names_and_what_the_gate_missed_beside_it():
    rows = [
        *GATE["channels"],
        {
            **GATE["channels"][1],
            "channel": "muscle_pressure_pa",
            "unit": "Pa",
            "before": 439.0,
            "after": 384.0,
            "floor": 224.0,
            "achieved_share": 0.32,
            "points": -68.1,
        },
    ]
    text = shown(replace(EXPLAINED, gate={**GATE, "channels": rows}))
    assert "Confidence in an effect: probability that the rig has" in text
    assert (
        "by themselves otherwise than predicted: muscle pressure 32 %" in text
        and "force 98" not in text.split("by themselves")[1]
    )
