"""What is wrong with logs, found and said before any effect is named; what is bad is taken out,
never mended silently.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.finding import Finding, measured_names
from epa_rt.gap.hygiene.ends import check_ends
from epa_rt.gap.hygiene.lines import check_lines
from epa_rt.gap.hygiene.pairs import check_pairs
from epa_rt.gap.hygiene.scale import check_scale
from epa_rt.gap.hygiene.skew import check_skew
from epa_rt.gap.hygiene.spikes import check_spikes
from epa_rt.gap.hygiene.still import check_still
from epa_rt.gap.hygiene.time import check_time
from epa_rt.gap.hygiene.twice import check_twice
from epa_rt.gap.hygiene.values import check_values
from epa_rt.gap.hygiene.valves import check_valves
from epa_rt.gap.hygiene.words import check_words
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.rig.read import misfits
from epa_rt.gap.side_by_side import each

Check = Callable[[Recording, Rig | None], Sequence[Finding]]

_REFUSED = (
    "recorded on the rig",
    "has no column for",
    "recorded at a period",
    "with reads",
    "with inverted",
    "is not what its raw bytes say",
)
_HOUSE = (
    check_time,
    check_words,
    check_values,
    check_scale,
    check_ends,
    check_pairs,
    check_skew,
    check_valves,
    check_spikes,
)
_AFTER_VALUES = (check_ends, check_pairs, check_spikes)
_LARGEST = float(np.finfo(np.float32).max)  # of a reading; squares of it and their sums are numbers
_ORDER = {"refuse": 0, "exclude": 1, "note": 2}


def check(
    recordings: Sequence[Recording],
    rig: Rig | None,
    steps: Mapping[str, float] | None = None,
    asked: Mapping[str, Sequence[str]] | None = None,
) -> tuple[Finding, ...]:
    """All findings, the worst first. ``rig`` None: a rig of others, of which only the columns are
    known, and what its file says by column: the ``steps`` of readings, SI, and which columns say
    what is ``asked`` of a place.

    Where one says ``refuse`` a diagnosis would mean nothing; the stretches and the lines of
    ``exclude`` are taken out by ``clean``.
    """
    if ran_away := [finding for recording in recordings for finding in _ran_away(recording)]:
        return tuple(ran_away)
    without_rig = (
        check_time,
        partial(check_values, steps=steps),
        *_AFTER_VALUES,
        partial(check_still, asked=asked),
    )
    of_all = _mixed(recordings) + check_twice(recordings) + check_lines(recordings)
    checks = without_rig if rig is None else _HOUSE
    of_each = each(lambda recording: _of_log(recording, rig, checks, of_all), recordings)
    found = [*of_all, *(finding for own in of_each for finding in own)]
    return tuple(sorted(found, key=lambda finding: _ORDER[finding.severity]))


def _of_log(
    recording: Recording, rig: Rig | None, checks: Sequence[Check], known: Sequence[Finding]
) -> list[Finding]:
    """What the checks find in one recording, beside what is known of it."""
    found = _said_by_log(recording, rig)
    for check_one in checks:
        own = [one for one in check_one(recording, rig) if not _said(one, [*known, *found])]
        found += own
        if any(finding.severity == "refuse" for finding in own):
            # a wrong unit, say, would be found again by every check that compares channels
            break
    return found


def clean(recordings: Sequence[Recording], findings: Sequence[Finding]) -> tuple[Recording, ...]:
    """The recordings on a grid without holes, NaN where samples were lost or a finding excludes
    them, ``found`` filled in.

    A line is subtracted from its channel as it was fitted. Commands and references of lost cycles
    are held (a terminal holds its outputs); measured values are never made up.
    """
    cleaned = []
    for recording in recordings:
        own = [finding for finding in findings if finding.log == recording.name]
        columns = {name: values.copy() for name, values in recording.columns.items()}
        for finding in own:
            for sinusoid in finding.sinusoids:
                columns[finding.channel] -= sinusoid.at(recording.cycle - recording.cycle[0])
            for start, stop in finding.rows if finding.severity == "exclude" else ():
                for name in [finding.channel] if finding.channel else measured_names(recording):
                    columns[name][start:stop] = np.nan
        said = [finding.says for finding in own]
        sentences = tuple(
            dict.fromkeys(
                (*(s for s in recording.found if f"{recording.name}: {s}" not in said), *said)
            )
        )
        cleaned.append(_on_grid(dataclasses.replace(recording, columns=columns, found=sentences)))
    return tuple(cleaned)


def _said(finding: Finding, found: Sequence[Finding]) -> bool:
    """Whether another check has said the same of every row that a finding takes out."""
    rows = [
        own
        for one in found
        if (one.log, one.channel, one.kind) == (finding.log, finding.channel, finding.kind)
        for own in one.rows
    ]
    return (
        finding.severity == "exclude"
        and bool(finding.rows)
        and all(any(a <= start and stop <= b for a, b in rows) for start, stop in finding.rows)
    )


def _ran_away(recording: Recording) -> list[Finding]:
    """The first column with which nothing can be reckoned: of a simulator or a loop that went
    unstable.
    """
    for name, values in recording.columns.items():
        most = np.max(np.abs(values), where=np.isfinite(values), initial=0.0)
        if most > _LARGEST:
            says = (
                f"{recording.name}: {name}: found values of up to {most:.3g}, expected none above"
                f" {_LARGEST:.3g}: what made this recording ran away"
            )
            return [Finding("refuse", "ran away", recording.name, name, says)]
    return []


def _mixed(recordings: Sequence[Recording]) -> list[Finding]:
    rigs = sorted({recording.rig for recording in recordings})
    if len(rigs) < 2:
        return []
    which = "; ".join(
        f"{rig or 'no name'}: {', '.join(r.name for r in recordings if r.rig == rig)}"
        for rig in rigs
    )
    return [
        Finding(
            "refuse",
            "mixed rigs",
            "",
            "",
            f"found logs of {len(rigs)} rigs ({which}), expected logs of one",
        )
    ]


def _said_by_log(recording: Recording, rig: Rig | None) -> list[Finding]:
    """What reading it found, and in what it does not fit the rig."""
    sentences = list(
        dict.fromkeys((*recording.found, *(misfits(recording, rig) if rig is not None else ())))
    )
    return [
        Finding(
            "refuse" if any(word in sentence for word in _REFUSED) else "note",
            "log",
            recording.name,
            "",
            f"{recording.name}: {sentence}",
        )
        for sentence in sentences
    ]


def _on_grid(recording: Recording) -> Recording:
    """Holes filled with rows of NaN, repeated cycles left out."""
    cycle = recording.cycle
    if not len(cycle) or np.all(np.diff(cycle) == 1):
        return recording
    first = np.concatenate([[True], np.diff(np.maximum.accumulate(cycle)) > 0])
    kept = np.flatnonzero(first)
    place = cycle[kept] - cycle[kept[0]]
    size = int(place[-1]) + 1
    held = kept[np.searchsorted(place, np.arange(size), side="right") - 1]
    lost = np.ones(size, bool)
    lost[place] = False
    columns = {}
    for name, values in recording.columns.items():
        columns[name] = values[held]
        if not name.startswith(("cmd_", "ref_")):
            columns[name] = np.where(lost, np.nan, columns[name])
    row_of = np.searchsorted(kept, np.arange(len(cycle) + 1))
    ends = np.append(place, size)
    spans = tuple(
        Span(s.name, int(ends[row_of[s.start]]), int(ends[row_of[s.stop]]), s.trial)
        for s in recording.spans
    )
    t_ns = (
        None
        if recording.t_ns is None
        else recording.t_ns[held]
        + (np.arange(size) - place[np.searchsorted(place, np.arange(size), side="right") - 1])
        * round(recording.period_s * 1e9)
    )
    return dataclasses.replace(
        recording, cycle=np.arange(size) + cycle[kept[0]], columns=columns, spans=spans, t_ns=t_ns
    )
