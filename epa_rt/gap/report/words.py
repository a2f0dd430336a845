"""Words and numbers of a diagnosis for people: the verdict, a channel, a size with its unit, a
share.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from epa_rt.config.units import with_unit
from epa_rt.gap.diagnosis import Diagnosis, Named, Number, Onset, Shrinkage
from epa_rt.gap.held_out.shrink import ALL, OVERALL
from epa_rt.gap.posterior.words import all_of, plain
from epa_rt.report.sections.section import spoken
from epa_rt.report.shown import Shown, number, pretty

VERDICTS = {
    "no_gap": ("No gap", "The plant file already describes these logs down to the noise."),
    "explained": ("Explained", "The named effects explain the gap."),
    "partly_explained": (
        "Partly explained",
        "The named effects explain part of the gap; the rest is described below.",
    ),
    "not_in_catalogue": (
        "Not in the catalogue",
        (
            "There is a gap, and no effect of the catalogue that these logs could have shown"
            " explains it."
        ),
    ),
    "not_excited": ("Not excited", "These logs could not have shown most of the effects."),
    "not_separable": ("Not separable", "Several effects explain these logs equally well."),
}
LEFT_OPEN = {
    "no_gap": ("Left open", "These logs do not tell whether there is a gap."),
    "not_in_catalogue": (
        "Left open",
        "There is a gap, and these logs do not tell whether a law of the catalogue explains it.",
    ),
}
GOOD = ("no_gap", "explained")
MODES = {"teacher_forced": "block by block", "free_run": "free run"}
BASELINES = {
    "refitted": "nominal parameters refitted, no effect",
    "plant_file": "plant file as it stands",
}
SOURCES = {
    "repeats": "repeats of the same trial",
    "twin": "a simulated run of the plant itself, with the recording's noise",
    "sensors": "the sensors' own noise, without what is slow (weaker than repeats)",
}
PROBABILITY = (
    "probability that the rig has an effect of its family and the plant file does not, on these"
    " logs and on logs that no fit has seen"
)
WHO = {"plant_file": "in the plant file, not in the rig", "both": "in both, at other strengths"}
BEYOND = 99.0  # standard deviations
# share closed below which the figure says less than how many times the floor it was and is: of a
# gap near the floor it soon is thousands of per cent
WORSE = -1.0
_SMALL = {
    "Pa": (1e3, 1.0, "Pa"),
    "A": (0.1, 1e3, "mA"),
    "m": (1e-5, 1e6, "µm"),
}  # below: in this smaller unit
_SHOWN = Shown()


def verdict_words(diagnosis: Diagnosis) -> tuple[str, str]:
    """The answer in a word or two, and what it means."""
    return (LEFT_OPEN if left_open(diagnosis) else VERDICTS)[diagnosis.verdict]


def left_open(diagnosis: Diagnosis) -> bool:
    """As ``Posterior.leaves_open``, where the answer is the posterior's."""
    could = diagnosis.posterior
    return could is not None and could.verdict == diagnosis.verdict and could.leaves_open


_NAME = re.compile(r"[a-z][a-z0-9]*(?:_[a-z0-9]+)+")


def size(value: float | None, unit: str, digits: int = 3) -> str:
    """A misfit or difference in the unit that a person reads; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    if unit == "x floor":
        return times(value)
    scale = _SHOWN.difference_scale(unit)
    below, small, small_unit = _SMALL.get(unit, (0.0, 1.0, ""))
    if 0.0 < abs(value) < below:
        return f"{number(value * small, digits)} {small_unit}"
    return f"{number(value * scale.factor, digits)} {scale.unit}".strip()


def times(value: float | None) -> str:
    """'12 ×' of the floor."""
    return (
        "–"
        if value is None or not math.isfinite(value)
        else f"{value:,.{1 if value < 9.95 else 0}f} ×"
    )


def percent(share: float | None) -> str:
    """'97 %'; a decimal near the whole, where it tells."""
    if share is None or not math.isfinite(share):
        return "–"
    value = 100.0 * share
    text = f"{value:.1f}" if 98.5 <= abs(value) < 110.0 else f"{value:.0f}"
    text = text.removesuffix(".0")
    return f"{'0' if text == '-0' else text} %".replace("-", "−")


def share_words(row: Shrinkage) -> str:
    """'97 % (95 to 98)'; 'no gap to close' where before does not rise above the floor, 'worse: 1.5
    × → 7.6 × floor' where it grew by more than itself.
    """
    if row.closed_share is None:
        return "no gap to close"
    if got_worse(row):
        return f"worse: {times(row.before / row.floor)} → {times(row.after / row.floor)} floor"
    if row.interval is None:
        return percent(row.closed_share)
    low, high = (percent(bound).removesuffix(" %") for bound in row.interval)
    return f"{percent(row.closed_share)} ({low} to {high})"


def got_worse(row: Shrinkage) -> bool:
    """Whether so much more is left after than before that it is said in multiples of the floor and
    not as a share.
    """
    return row.closed_share is not None and row.closed_share < WORSE


def sigmas(significance: float) -> str:
    """Standard deviations by which a gap stands above noise; no more than tells."""
    return f"> {BEYOND:.0f}" if significance > BEYOND else f"{max(significance, 0.0):.0f}"


def parameter_words(one: Number) -> tuple[str, str, str, str]:
    """Value, 95 % interval, neutral value and unit, all in the same unit: SI where the reader's
    would give long numbers.
    """
    factor, _, unit = _SHOWN.difference_scale(one.unit)
    if not 1e-3 <= abs(one.value * factor) < 1e5:
        factor, unit = 1.0, one.unit if one.unit != "1" else ""
    value, low, high, neutral = (
        number(x * factor, 4) for x in (one.value, one.low, one.high, one.neutral)
    )
    return value, f"{low} to {high}", neutral, pretty(unit)


def by_log_words(effect: Named) -> str:
    """'Strength by log: ...' with intervals; '' where there is one log, or the rig has none."""
    if not effect.by_log or effect.who == "plant_file":
        return ""
    parts = []
    for one in effect.by_log:
        value, interval, _, unit = parameter_words(one)
        parts.append(f"{one.name} {with_unit(value, unit)} ({interval})")
    return f"Strength by log: {'; '.join(parts)}."


def gone_words(one: Number) -> tuple[str, str, str, str]:
    """The same of an effect that the rig does not have: what shapes it cannot be fitted where it is
    not.
    """
    _, _, neutral, unit = parameter_words(replace(one, value=one.neutral))
    return "gone", "–", neutral, unit


def region_words(region: str) -> str:
    """'muscle speed > 0' of 'muscle_speed_m_s > 0'."""
    return _NAME.sub(
        lambda found: spoken(found.group().removesuffix("_m_s2").removesuffix("_rad_s2")), region
    )


def channel_words(channel: str) -> str:
    """'muscle force' of 'muscle_force_n'; sentences stay as they are, with the names in them
    spoken.
    """
    return channel if channel == OVERALL else region_words(channel)


def shown_rows(diagnosis: Diagnosis) -> list[Shrinkage]:
    """Rows over all logs: against the refitted plant where effects are named, else what refitting
    it did to the plant file.
    """
    baseline = _counted_from(diagnosis)
    return [row for row in diagnosis.shrinkage if row.log == ALL and row.baseline == baseline]


def before_words(diagnosis: Diagnosis) -> str:
    """What the shown rows count from."""
    if diagnosis.changes:
        return "the rig as its healthy runs have it"
    return BASELINES[_counted_from(diagnosis)]


def _counted_from(diagnosis: Diagnosis) -> str:
    return "refitted" if diagnosis.effects else "plant_file"


def headline(diagnosis: Diagnosis) -> Shrinkage | None:
    """The one row that says how far: block by block if there is one, all channels, all logs."""
    rows = {row.mode: row for row in shown_rows(diagnosis) if row.channel == OVERALL}
    return next((rows[mode] for mode in MODES if mode in rows), None)


def named_words(effect: Named) -> str:
    """'braid friction', with who has it where that is not the rig alone."""
    return plain(effect.name) + (f" ({WHO[effect.who]})" if effect.who in WHO else "")


def alike_words(diagnosis: Diagnosis) -> str:
    """'braid friction from braid dahl': names with the laws that they cannot be told from; '' where
    there are none.
    """
    return "; ".join(
        f"{plain(one.name)} from {join_words(one.not_separable_from)}"
        for one in diagnosis.effects
        if one.not_separable_from
    )


def said_otherwise(diagnosis: Diagnosis) -> tuple[Number, ...]:
    """Numbers of the plant file, within belief, whose interval is without what the file says."""
    return tuple(
        one
        for one in diagnosis.nominal
        if not one.low <= one.neutral <= one.high and one not in diagnosis.nominal_moved
    )


def judged_on(diagnosis: Diagnosis) -> str:
    """On what the shrinkage was measured."""
    held = diagnosis.inputs.get("holdout") or ()
    if held:
        return (
            f"held-out {'log' if len(held) == 1 else 'logs'}"
            f" {', '.join(Path(str(one)).stem for one in held)}, which no fit has seen"
        )
    if diagnosis.inputs.get("set_aside", True):
        return "trials that were set aside, which no fit has seen"
    return "the very trials that were fitted (nothing could be set aside, so the figures flatter)"


def free_run_words(diagnosis: Diagnosis) -> str:
    """What the whole plant says that runs from the commands alone; nothing where the rig has no
    model of it.
    """
    heard = diagnosis.free_run
    if heard is None:
        return ""
    if heard.explained_share is None:
        return (
            "The whole plant, run from the commands alone, shows no gap beyond its noise once the"
            " nominal parameters are fitted."
        )
    who = (
        join_words(heard.nearest)
        if diagnosis.effects
        else f"what comes nearest ({join_words(heard.nearest)})"
        if heard.nearest
        else ""
    )
    explain = "explain" if diagnosis.effects and len(heard.nearest) > 1 else "explains"
    found = [
        (
            f"The whole plant, run from the commands alone, shows a gap; {who} {explain}"
            f" {percent(heard.explained_share)} of it."
            if heard.nearest
            else (
                "The whole plant, run from the commands alone, shows a gap that nothing named"
                " explains."
            )
        )
    ]
    return " ".join(found)


def more_numbers_words(effect: Named) -> str:
    """'braid lugre, of the same family, says the same of these logs with more numbers': laws that
    became a named effect; '' where none did.
    """
    others = effect.in_more_numbers
    return (
        f"{join_words(others)}, of the same family, {'says' if len(others) == 1 else 'say'} the"
        " same of these logs with more numbers"
        if others
        else ""
    )


def join_words(names: Sequence[str]) -> str:
    """Effects' names in plain words, the last two with an "and"."""
    return all_of([plain(name) for name in names])


def onset_words(onset: Onset | None) -> str:
    """'From about 20 s of log_2 on ... ' with sizes; '' where nothing begins within a log."""
    if onset is None:
        return ""
    last = "to its end" if onset.lasts == "log" else "and in all later logs"
    return (
        f"From about {onset.at_s:.0f} s of {onset.log} on, {last}: {plain(onset.effect)} is"
        f" {size(onset.after, onset.unit)}, {size(onset.before, onset.unit)} before"
        f" (looked for every {onset.within_s:.2g} s)."
    )
