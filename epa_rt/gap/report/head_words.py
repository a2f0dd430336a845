"""The four lines at the head of an answer: where, which, how far, what next."""

from epa_rt.gap.diagnosis import Diagnosis
from epa_rt.gap.report.words import (
    alike_words,
    channel_words,
    got_worse,
    headline,
    named_words,
    plain,
    share_words,
    size,
    times,
)


def where_words(diagnosis: Diagnosis) -> str:
    """The first place's link, channel, excess over the floor and times its floor; words where none
    could be judged.
    """
    if not diagnosis.location:
        return "no link could be judged"
    place = diagnosis.location[0]
    return (
        f"{place.link} ({channel_words(place.channel)}): {size(place.excess, place.unit)} above the"
        f" floor, {times(place.times_floor)} floor"
    )


def which_words(diagnosis: Diagnosis) -> str:
    """Names of the effects in plain words, with commas; words where none is named."""
    return ", ".join(named_words(effect) for effect in diagnosis.effects) or "no effect is named"


def far_words(diagnosis: Diagnosis) -> str:
    """Share of the gap that is closed, and times the floor before and after, by ``headline``."""
    row = headline(diagnosis)
    if row is None:
        return "not measured"
    by = "" if diagnosis.effects else " by refitting nominal parameters"
    if got_worse(row):
        return share_words(row).replace("worse", f"worse{by}")
    return (
        f"{share_words(row)} of the gap closed{by}; {times(row.before)} → {times(row.after)} floor"
        if row.closed_share is not None
        else "no gap to close"
    )


def next_words(diagnosis: Diagnosis) -> str:
    """Name of the next experiment, or why there is none."""
    if diagnosis.next_experiment:
        return (
            plain(diagnosis.next_experiment.name)
            if diagnosis.next_experiment.tells
            else "none of the menu would tell"
        )
    return (
        "not looked for"
        if diagnosis.verdict == "not_separable" or alike_words(diagnosis)
        else "none needed"
    )
