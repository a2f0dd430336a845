"""What was asked: the experiment in words."""

from epa_rt.config.experiment import ExperimentFile, PhaseFile
from epa_rt.report.markup import Html, Marked, folded, join, note, paragraph, table, tag
from epa_rt.report.run import Run
from epa_rt.report.sections.section import Section
from epa_rt.report.words import (
    LOOPS,
    end_words,
    experiment_file,
    motion_words,
    repeat_words,
    valve_words,
)


def asked(run: Run) -> Section:
    """Raises NotShown where the log has no experiment that can be read."""
    run.require_experiment()
    text = run.text("experiment.yaml")
    file = experiment_file(text)
    return Section(
        "asked",
        "What was asked",
        join(
            [
                phase_table(file),
                note(
                    "Trials are marked; what a $name stands for in each repetition is said above"
                    " the table."
                ),
                folded("The experiment file", tag("pre", text)),
            ]
        ),
    )


def phase_table(file: ExperimentFile) -> Html:
    """All phases of a file in order: before, repeated, after."""
    parts = []
    for phases, title in (
        (file.before, "Once, before"),
        (file.phases, _repeated(file)),
        (file.after, "Once, after"),
    ):
        if phases:
            parts.append(paragraph(tag("strong", title)) if title else "")
            head = ("Phase", "Controls", "Motion", "Valves", "Ends")
            parts.append(
                table(
                    head,
                    [_row(phase, file) for phase in phases],
                    text_columns=range(5),
                    class_="words",
                )
            )
    return join(parts)


def _repeated(file: ExperimentFile) -> str:
    repeated = repeat_words(file)
    if repeated:
        return repeated[0].upper() + repeated[1:]
    return "Once" if file.before or file.after else ""


def _row(phase: PhaseFile, file: ExperimentFile) -> list[object]:
    cells = [
        phase.name,
        LOOPS[phase.loop or file.loop],
        motion_words(phase),
        valve_words(phase),
        end_words(phase),
    ]
    if not phase.trial:
        return cells
    cells[0] = join([phase.name, " ", tag("span", "trial", class_="mark")])
    return Marked("trial", cells)
