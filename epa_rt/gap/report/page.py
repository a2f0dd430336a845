"""One self-contained HTML page for one diagnosis: the verdict, where, which, how far, what is left,
what next.
"""

from collections.abc import Sequence

from epa_rt.gap.diagnosis import Diagnosis
from epa_rt.gap.report.could import posterior_section
from epa_rt.gap.report.curves import figure
from epa_rt.gap.report.effects import catalogue_note, effects, not_tested
from epa_rt.gap.report.far import how_far
from epa_rt.gap.report.frame import framed
from epa_rt.gap.report.gate import gate_section
from epa_rt.gap.report.head_words import far_words, next_words, where_words, which_words
from epa_rt.gap.report.left_words import ends_words
from epa_rt.gap.report.map import gap_map
from epa_rt.gap.report.origin import origins
from epa_rt.gap.report.rest import found_first, inputs, next_experiment, remainder
from epa_rt.gap.report.traces import Trace
from epa_rt.gap.report.words import GOOD, left_open, verdict_words
from epa_rt.report.markup import Html, facts, join, tag


def gap_page(diagnosis: Diagnosis, curves: Sequence[Trace] = ()) -> str:
    """The report of a diagnosis. Nothing in it is fetched, and it runs no script."""
    sections = [
        ("could", "What it could be", posterior_section(diagnosis)),
        ("where", "Where the gap lies", join([gap_map(diagnosis), origins(diagnosis)])),
        ("seen", "Before and after", join(map(figure, curves))),
        ("which", "Which effect causes it", join([effects(diagnosis), catalogue_note(diagnosis)])),
        ("far", "How far it shrinks", how_far(diagnosis)),
        (
            "gate",
            "The patched plant, run again",
            gate_section(diagnosis.gate) if diagnosis.gate else Html(""),
        ),
        ("left", "What is left", remainder(diagnosis)),
        ("next", "The next experiment", next_experiment(diagnosis)),
        ("untested", "What was not tested", not_tested(diagnosis)),
        ("inputs", "What this stands on", inputs(diagnosis)),
    ]
    word, _ = verdict_words(diagnosis)
    return framed(f"Sim-to-real gap: {word.lower()}", _header(diagnosis), sections)


def _header(diagnosis: Diagnosis) -> Html:
    word, meaning = verdict_words(diagnosis)
    good = diagnosis.verdict in GOOD and not left_open(diagnosis)
    rig, plant = (diagnosis.inputs.get(key) for key in ("rig", "plant"))
    told = (
        f"Diagnosis of the gap between {rig} and {plant}"
        if rig and plant
        else "Diagnosis of the sim-to-real gap"
    )
    return join(
        [
            tag("p", told, class_="kicker"),
            found_first(diagnosis),
            tag("h1", diagnosis.says),
            tag(
                "p",
                join([tag("span", word, class_=f"badge {'good' if good else 'open'}"), meaning]),
            ),
            facts(
                [
                    ("Where", where_words(diagnosis)),
                    (
                        "Which",
                        "; ".join(filter(None, (which_words(diagnosis), ends_words(diagnosis)))),
                    ),
                    ("How far", far_words(diagnosis)),
                    ("Next experiment", next_words(diagnosis)),
                ]
            ),
        ]
    )
