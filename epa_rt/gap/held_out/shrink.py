"""How far the gap shrinks: before, after and floor of every channel, block by block and in free
run, on held-out logs.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from epa_rt.gap.diagnosis import Baseline, Mode, Shrinkage
from epa_rt.gap.held_out.share import Squares, share, squares
from epa_rt.gap.likelihood.alongside import (
    BLOCK_S,
    channels,
    figure_misfits,
    misfit,
    step_of,
    unit_of,
)
from epa_rt.gap.likelihood.floor import FLOOR_SEEDS, Floor, left_over
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.recording import Recording
from epa_rt.gap.side_by_side import each
from epa_rt.gap.subject import Link, Subject, Values

OVERALL, ALL = "all channels", "all"
UNMOVED = 0.01  # of a channel's step: twins that differ by less do not differ
_Misfits = dict[tuple[str, str], dict[str, Squares]]  # (channel, unit) to recording name to squares
Pairs = Sequence[tuple[Recording, Recording]]  # of runs that differ by noise alone


def shrinkage(
    subject: Subject,
    recordings: Sequence[Recording],
    before_values: Values,
    after_values: Values,
    floors: Mapping[str, Floor],
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> tuple[Shrinkage, ...]:
    """Before, after and floor per channel, over all logs and per log where there are several.

    ``before_values``: nominal parameters refitted without the effects; ``after_values``: with them.
    Each comparison stands twice, against ``before_values`` (baseline "refitted", what only the
    effects explain) and against the plant file as it is ("plant_file"). Teacher-forced by link,
    with the links' floors; in free run by measured channel and by what an operator asks for, with
    the floor of the plant's own twin (seeds 1 to 3 against no noise). ``all channels`` weighs each
    channel by its floor.
    """
    progress("how far: block by block", 0.0)
    found: list[Shrinkage] = []
    for baseline, values in (("refitted", before_values), ("plant_file", {})):
        found += _teacher_forced(subject, recordings, values, after_values, floors, baseline)
    progress("how far: free run", 0.5)
    return (*found, *_free_run(subject, recordings, before_values, after_values))


def how_far_of(
    subject: Subject,
    recordings: Sequence[Recording],
    problem: Problem,
    before: Values,
    after: Values,
    floors,
    seed: int,
    progress: Callable[[str, float], None],
) -> tuple[Shrinkage, ...]:
    """The shrinkage with the floors that ``problem`` was fitted with. On logs or trials that no fit
    has seen what the method itself leaves is found anew, by ``floors``: that of the fitted ones is
    not known there. ``subject``: the one that judges the recordings.
    """
    names = {r.name for r in problem.recordings}
    level = problem.floors
    aside = subject is not problem.subject and any(floor.bias for floor in level.values())
    if aside or not all(r.name in names for r in recordings):
        level = floors(subject, recordings, after, seed=seed)
    return shrinkage(subject, recordings, before, after, level, progress=progress)


def _teacher_forced(
    subject: Subject,
    recordings: Sequence[Recording],
    before: Values,
    after: Values,
    floors: Mapping[str, Floor],
    baseline: Baseline,
) -> list[Shrinkage]:
    found: _Misfits = {}
    ready = [subject.prepare(recording) for recording in recordings]
    for link in (link for link in subject.links if link.name in floors):
        floor, channel = floors[link.name], label(subject.links, link)
        for recording, one in zip(recordings, ready, strict=True):
            residuals = [
                left_over(subject, one, values, floor, recording.name) for values in (before, after)
            ]
            _add(
                found,
                recording.name,
                {(channel, link.unit): squares(*residuals, floor.rms, _per_block(subject))},
            )
    source = next((floors[link.name].source for link in subject.links if link.name in floors), "")
    return _rows(found, "teacher_forced", baseline, source)


def _free_run(
    subject: Subject, recordings: Sequence[Recording], before: Values, after: Values
) -> list[Shrinkage]:
    """Both baselines at once, so that every plant runs once per log."""
    found: dict[Baseline, _Misfits] = {"refitted": {}, "plant_file": {}}
    asked: dict[Baseline, _Misfits] = {"refitted": {}, "plant_file": {}}
    for recording in filter(subject.told, recordings):
        plants = [
            (before, None),
            ({}, None),
            (after, None),
            *((after, seed) for seed in FLOOR_SEEDS),
        ]
        refitted, as_file, best, *twins = each(
            lambda plant, of=recording: subject.free_run(of, *plant), plants
        )
        if best is None or any(twin is None for twin in twins):
            return []
        apart = [[(twin, best) for twin in twins]]
        for baseline, run in (("refitted", refitted), ("plant_file", as_file)):
            runs = (recording, run, [best], apart)
            _add(found[baseline], recording.name, channel_squares(subject, *runs))
            _add(asked[baseline], recording.name, figure_squares(*runs))
    return [
        row
        for baseline in found
        for row in (
            *_rows(found[baseline], "free_run", baseline, "twin"),
            *_rows(asked[baseline], "free_run", baseline, "twin", overall=False),
        )
    ]


def channel_squares(
    subject: Subject,
    real: Recording,
    before: Recording,
    after: Sequence[Recording],
    apart: Sequence[Pairs],
    noise: Mapping[str, float] | None = None,
) -> dict[tuple[str, str], Squares]:
    """Misfits of a run, and of several of the same plant (in the mean of their squares), against
    the real one by channel, over the trials.

    The floor is what runs of that plant differ by, ``apart`` (pairs for each of ``after``, in the
    mean of their squares); the channel's own step where they do not. Where the runs carry the
    simulation's noise and not the recording's, ``noise`` (channel to rms) is the recording's own.
    """
    found = {}
    for name in channels(real, after[0]):
        of_before, *of_after = (
            misfit(real, run, name, subject.rate_hz) for run in (before, *after)
        )
        differ = _rms(
            [
                np.array(
                    [_rms([one for a, b in pairs for one in misfit(a, b, name, subject.rate_hz)])]
                )
                for pairs in apart
            ]
        )
        step, floor = step_of(real, name), _with_noise(differ, (noise or {}).get(name, 0.0))
        floor = floor if floor > UNMOVED * step else step / np.sqrt(12.0)
        rows = [
            squares(*_as_long(b, _mean_square(a)), floor, _per_block(subject))
            for b, a in zip(of_before, zip(*of_after, strict=True), strict=True)
        ]
        if rows:
            found[name, unit_of(subject, name)] = Squares(
                *(np.concatenate(column) for column in zip(*rows, strict=True))
            )
    return found


def figure_squares(
    real: Recording,
    before: Recording,
    after: Sequence[Recording],
    apart: Sequence[Pairs],
    noise: Mapping[str, float] | None = None,
) -> dict[tuple[str, str], Squares]:
    """The same for what an operator asks for; a trial is a block."""
    differ = [
        [{name: parts[0] for name, _, parts in figure_misfits(a, [b])} for a, b in pairs]
        for pairs in apart
    ]
    found = {}
    for name, unit, (of_before, *of_after) in figure_misfits(real, [before, *after]):
        if all(name in one for pairs in differ for one in pairs):
            floor = _with_noise(
                _rms([np.array([_rms([one[name] for one in pairs])]) for pairs in differ]),
                (noise or {}).get(name, 0.0),
            )
            found[name, unit] = squares(*_as_long(of_before, _mean_square(of_after)), floor, 1)
    return found


def _mean_square(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Root of the mean square of several misfits, sample by sample, as long as the shortest."""
    least = min(map(len, parts))
    return (
        np.sqrt(np.mean([part[:least] ** 2 for part in parts], axis=0))
        if len(parts) > 1
        else parts[0]
    )


def _as_long(one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    least = min(len(one), len(other))
    return one[:least], other[:least]


def _with_noise(apart: float, noise: float) -> float:
    """Two runs of one plant are ``apart`` by the noise of both; of the recording and a run, one
    carries ``noise``.
    """
    return max(apart, float(np.sqrt(0.5 * apart**2 + noise**2)))


def _rows(
    found: _Misfits, mode: Mode, baseline: Baseline, source: str, overall: bool = True
) -> list[Shrinkage]:
    rows = []
    if overall and found:
        names = dict.fromkeys(name for logs in found.values() for name in logs)
        whole = {
            name: together([logs[name] for logs in found.values() if name in logs])
            for name in names
        }
        found = {(OVERALL, "x floor"): whole} | found
    for (channel, unit), logs in found.items():
        scopes = {ALL: list(logs.values())} | (
            {name: [one] for name, one in logs.items()} if len(logs) > 1 else {}
        )
        for name, chosen in scopes.items():
            one = share(chosen)
            if one is not None and one.floor > 0.0:
                rows.append(
                    Shrinkage(
                        channel,
                        unit,
                        mode,
                        name,
                        one.before,
                        one.after,
                        one.floor,
                        one.closed,
                        one.interval,
                        one.times_floor,
                        source,
                        baseline,
                    )
                )
    return rows


def together(of_channels: Sequence[Squares]) -> Squares:
    """All channels of one log as one, block by block, each in units of its floor; one without a
    floor stands aside.
    """
    count = max(len(one.samples) for one in of_channels)
    total = Squares(*(np.zeros(count) for _ in Squares._fields))
    for one in of_channels:
        floor2 = one.floor.sum() / max(one.samples.sum(), 1.0)
        if floor2 > 0.0:
            for sums, more in zip(
                total,
                (one.before / floor2, one.after / floor2, one.floor / floor2, one.samples),
                strict=True,
            ):
                sums[: len(more)] += more
    return total


def label(links: Sequence[Link], link: Link) -> str:
    """What a row in which a link is judged has as its channel: with the link where two links end in
    the same one.
    """
    return (
        link.channel
        if sum(one.channel == link.channel for one in links) == 1
        else f"{link.channel} ({link.name})"
    )


def _add(found: _Misfits, recording: str, more: Mapping[tuple[str, str], Squares]) -> None:
    for key, one in more.items():
        found.setdefault(key, {})[recording] = one


def _per_block(subject: Subject) -> int:
    return max(round(BLOCK_S * subject.rate_hz), 1)


def _rms(parts: Sequence[np.ndarray]) -> float:
    together = np.concatenate(parts) if parts else np.zeros(0)
    return float(np.sqrt(np.nanmean(together**2))) if np.isfinite(together).any() else 0.0
