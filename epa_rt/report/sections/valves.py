"""Valve switchings: how many, and when."""

from epa_rt.report.markup import join, note, paragraph, table, tag
from epa_rt.report.measures.valves import valve_counts
from epa_rt.report.run import NotShown, Run
from epa_rt.report.sections.section import Section
from epa_rt.report.shown import count


def valves(run: Run) -> Section:
    """Raises NotShown where the rig has no muscle."""
    counts = valve_counts(run)
    if not counts:
        raise NotShown("this rig has no muscle")
    switched = {key for one in counts for key in one.by_phase}
    phases = list(
        dict.fromkeys(
            name
            for span in run.phases
            if (name := span.phase.key if span.phase else span.name) in switched
        )
    )
    outside = any("" in one.by_phase for one in counts)
    head = [
        "Muscle",
        "Valve",
        "All",
        "During trials",
        *phases,
        *(["outside of phases"] if outside else []),
    ]
    keys = [*phases, *([""] if outside else [])]
    rows = [
        [
            one.muscle,
            one.valve,
            one.total,
            _trials(one.in_trials),
            *(one.by_phase.get(key, 0) for key in keys),
        ]
        for one in counts
    ]
    in_trials = sum(one.in_trials for one in counts)
    verdict = (
        "No valve switched during a trial."
        if not in_trials
        else f"Valves switched {count(in_trials, 'time')} during trials."
    )
    return Section(
        "valves",
        "Valve switchings",
        join(
            [
                paragraph(tag("strong", verdict)),
                table(head, rows, (0, 1)),
                note(
                    "Openings and closings of the commanded valves count one each; repetitions of a"
                    " phase are added up.",
                    " Outside of phases: the safe state at the run's end." if outside else "",
                ),
            ]
        ),
    )


def _trials(n: int) -> object:
    return tag("strong", f"▲ {n}", class_="off") if n else "0"
