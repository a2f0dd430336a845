"""A comparison in words: what a terminal shows, and the sentences of its page."""

from __future__ import annotations

import textwrap

from epa_rt.report.run import Run
from epa_rt.report.sections.section import spoken
from epa_rt.report.shown import seconds
from epa_rt.runs.compare import DRIFT, MISSING, NOISE, Comparison, Difference
from epa_rt.runs.noise import BLOCK_S, LATE_CYCLES, SIGMAS

_WIDTH = 79
_IMPORTED = "imported"  # the outcome of a log that epa import wrote; its cause is the file's name
_MOST = 12  # differences that a terminal lists
_STAYS = "\N{NO-BREAK SPACE}"  # keeps a figure beside its unit
_CONTROL = dict.fromkeys((*range(0x20), *range(0x7F, 0xA0)), "?")

METHOD = (
    "Runs are laid over each other phase by phase, from each phase's begin. Means over"
    f" {BLOCK_S:g} s are compared; two in a row must differ. A difference is dated back to where it"
    " rose above a fifth of what chance explains.",
    "Noise is taken from the two logs: the scatter of B less A from one mean to the next (Allan"
    f" deviation by the median), times {SIGMAS:g}.",
    f"Allowed beside noise: the converter's rounding, a begin {LATE_CYCLES} cycles earlier or"
    " later, and what the valves leave open. Each run may end a set anywhere in its tolerance: so"
    " pressures may differ by two tolerances, forces, torques and currents by that share of theirs,"
    " and places of a joint that muscles move by that share of their range.",
    "While valves are at work outside of a trial, only the end of the phase is compared: each run"
    " opens them when it must. While a muscle's valves are shut in both, a pressure that moves away"
    " from the other run's counts even within the tolerance: so a slow leak shows.",
    "A signal whose samples scatter half as much again as the other run's is called noisier.",
)


def verdict(found: Comparison) -> str:
    """The answer in one sentence."""
    if found.identical:
        return "Nothing differs: both logs hold the same samples, bit for bit."
    first = found.first
    if first is None and found.is_different:
        return "No signal differs by more than chance, but the runs did not go alike."
    if first is None:
        return "Nothing differs by more than noise and what the valves leave open."
    words = difference_words(found.a, first)
    if found.asked and found.asked[0].at_s <= first.at_s:
        names = ", ".join(dict.fromkeys(one.signal for one in found.asked))
        return f"Other things were asked for ({names}), and so: {words}"
    return words


def difference_words(run: Run, one: Difference) -> str:
    """'Muscle pressure is lower by up to 1.65 kPa (...) from 2.70 s of trial[1] on, ...'."""
    place = f"from {one.since_s:.1f} s of {one.phase} on, {seconds(one.at_s)} into run A"
    name = spoken(one.signal).capitalize()
    if one.kind == MISSING:
        return f"{name} has no value in one of the runs {place}."
    if one.kind == NOISE:
        way = "more" if one.largest > 0.0 else "less"
        size = run.shown.difference(abs(one.largest), one.unit)
        return f"{name} of B is {way} noisy than A's by {size} (one sample) {place}."
    size = run.shown.difference(abs(one.largest), one.unit)
    allowed = run.shown.difference(one.allowed, one.unit)
    way = "below" if one.largest < 0.0 else "above"
    if one.kind == DRIFT:
        return (
            f"{name} of B moves to {size} {way} A's while its valves are shut, {place} (explained"
            f" by chance: {allowed})."
        )
    return f"{name} of B lies up to {size} {way} A's {place} (explained by chance: {allowed})."


def ends(found: Comparison) -> list[str]:
    """Runs that ended otherwise, and phases that only one of them has."""
    a, b = found.a, found.b
    said = []
    if a.outcome != b.outcome or (a.cause != b.cause and a.outcome != _IMPORTED):
        said.append(f"A {_ended(a)}; B {_ended(b)}.")
    for name, only in (("A", found.only_a), ("B", found.only_b)):
        if only:
            said.append(
                f"Only {name} has {len(only)} of the phases: {', '.join(only[:4])}"
                f"{' and more' if len(only) > 4 else ''}."
            )
    said += [
        f"{pair.name} lasted {seconds(a.seconds(pair.a))} in A, {seconds(b.seconds(pair.b))} in B."
        for pair in found.other_length
    ]
    return said


def _ended(run: Run) -> str:
    return f"{run.outcome}{f' ({run.cause})' if run.cause else ''}"


def run_words(run: Run) -> str:
    """'b1.mcap: identification_short on bench, completed, 29.267 s'."""
    told = run.facts
    lasted = seconds(len(run.t_s) * run.period_s).replace(" ", _STAYS)
    return (
        f"{run.name}: {told.get('experiment', 'experiment not recorded')} on"
        f" {told.get('rig', 'rig not recorded')}, {run.outcome}, {lasted}"
    )


def as_text(found: Comparison) -> str:
    """What a person reads in a terminal of 80 columns."""
    blocks = [f"A  {run_words(found.a)}", f"B  {run_words(found.b)}", *ends(found)]
    for name, run in (("A", found.a), ("B", found.b)):
        blocks += [f"{name} is not whole: {sentence}" for sentence in run.missing]
    blocks += list(found.notes)
    blocks += [f"Set up differently: {what}" for what, _ in found.set_up]
    blocks.append("")
    blocks.append(verdict(found))
    if found.asked and not found.differences:
        names = ", ".join(dict.fromkeys(one.signal for one in found.asked))
        blocks.append(f"Asked for differently: {names}.")
    lines = [line for block in blocks for line in _wrapped(block)]
    if found.differences:
        lines += ["", _row("since", "phase", "signal", "B - A", "by chance")]
        lines += [_difference_row(found.a, one) for one in found.differences[:_MOST]]
        more = len(found.differences) - _MOST
        lines += [f"and {more} more (--json, --html)"] if more > 0 else []
    return "\n".join(lines)


def _wrapped(text: str) -> list[str]:
    clean = text.translate(_CONTROL)
    lines = textwrap.wrap(clean, _WIDTH, subsequent_indent="   ", break_on_hyphens=False) or [""]
    return [line.replace(_STAYS, " ") for line in lines]


def _difference_row(run: Run, one: Difference) -> str:
    size = (
        "missing"
        if one.kind == MISSING
        else run.shown.difference(one.largest, one.unit, signed=True)
    )
    allowed = "-" if one.kind == MISSING else run.shown.difference(one.allowed, one.unit)
    kind = f" ({one.kind})" if one.kind in (DRIFT, NOISE) else ""
    return _row(f"{one.at_s:.1f} s", one.phase, one.signal + kind, size, allowed)


def _row(since: str, phase: str, signal: str, size: str, allowed: str) -> str:
    cells = (
        f"{since:>9}  {phase.split(' ')[0][:14]:<14}  {signal[:26]:<26}  {size:>12}  {allowed:>10}"
    )
    return cells.translate(_CONTROL).rstrip()
