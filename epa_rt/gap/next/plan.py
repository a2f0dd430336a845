"""What next: the experiment that tells apart best what the data at hand cannot, found by simulating
every rival.

A rival's own plant makes the data of the experiment; every other rival is refitted to it, nominal
parameters and all. What is left then, in units of the noise, is the distance that the experiment
would put between them.
"""

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from epa_rt.gap.diagnosis import DECIDES, TELLS, NextExperiment
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.menu import Item, joined

# what an experiment should promise: no rig is one of the rivals' plants, and it often tells less
AMPLE = 16.0 * DECIDES
# of trials, to which an experiment that promises less is drawn out; what fills and moves between
# them comes on top
LONGEST_S = 300.0


class Rival(NamedTuple):
    """One of several answers that fit alike: its effects' names, and the plant file that has
    them.
    """

    names: tuple[str, ...]
    plant_text: str


Simulate = Callable[
    [Item, str], Recording | None
]  # experiment, plant text; None where the run did not complete
Distance = Callable[
    [Recording, Rival, Rival], float
]  # data made by the first, chi-square of the second over the first


class Judged(NamedTuple):
    """An experiment of the menu, the least distance (chi-square) that it puts between two rivals,
    and how long its trials take. ``apart``: what it puts between any two, in one order; empty where
    an experiment that is beaten was not asked for all.
    """

    item: Item
    distance: float
    trials_s: float
    apart: tuple[float, ...] = ()

    @property
    def mean(self) -> float:
        """What it puts between any two in the mean, none counted for more than decides."""
        return float(np.mean(np.minimum(self.apart, DECIDES))) if self.apart else 0.0

    @property
    def times(self) -> int:
        """Rounds that promise amply, as far as anybody waits; 1 where one round does or no more can
        be had. Distances grow as trials do, as long as noise is all that hides them.
        """
        if self.distance <= 0.0 or self.item.rounds is None or self.trials_s <= 0.0:
            return 1
        return max(min(int(np.ceil(AMPLE / self.distance)), int(LONGEST_S / self.trials_s)), 1)

    @property
    def longer(self) -> Item | None:
        """The same with so many rounds; None where one does, or all that can be had should not
        tell.
        """
        return (
            self.item.rounds(self.times)
            if self.times > 1 and self.distance * self.times >= TELLS
            else None
        )

    @property
    def reach(self) -> tuple[float, float]:
        """What experiments are chosen by: what all rounds should give, no more than is ample, then
        what one does. Both fall as the distance does.
        """
        return min(self.distance * self.times, AMPLE), self.distance

    def beats(self, other: "Judged") -> bool:
        """Whether it is the better one: by its reach, and where there is none for the closest two
        rivals, by what it does for the others.
        """
        return (*self.reach, self.mean) > (*other.reach, other.mean)


def next_experiment(
    rivals: Sequence[Rival],
    items: Sequence[Item],
    simulate: Simulate,
    distance: Distance,
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> NextExperiment | None:
    """The experiment with the largest least distance between any two rivals, with more rounds where
    one does not decide amply, or another beside it where one does not decide for all; None where
    none could be simulated.
    """
    best: Judged | None = None
    every: list[Judged] = []
    for k, item in enumerate(items):
        progress(
            f"next experiment: {item.name} {' '.join(item.settings.values())}", k / (len(items) + 3)
        )
        found = _judged(rivals, item, simulate, distance, best if len(rivals) == 2 else None)
        if found is None:
            continue
        every.append(found)
        if best is None or found.beats(best):
            best = found
    if best is None:
        return None

    def or_better(asked: Item | None, share: float) -> Judged:
        """Of the best one and another, which is asked for all rivals, the one that sets the closest
        further apart.
        """
        if asked is None:
            return best
        progress(f"next experiment: {asked.name} {' '.join(asked.settings.values())}", share)
        found = _judged(rivals, asked, simulate, distance, None)
        return found if found is not None and found.distance > best.distance else best

    best = or_better(best.longer, 1.0 - 3.0 / (len(items) + 3))
    if best.distance < DECIDES:
        both = or_better(_beside(every), 1.0 - 2.0 / (len(items) + 3))
        if both is not best and both.distance >= DECIDES:
            best = both
            best = or_better(best.longer, 1.0 - 1.0 / (len(items) + 3))
    return _proposed(best, rivals)


def _proposed(best: Judged, rivals: Sequence[Rival]) -> NextExperiment:
    item = best.item
    names = tuple(
        dict.fromkeys(
            name
            for rival in rivals
            for name in rival.names
            if not all(name in other.names for other in rivals)
        )
    )
    settings = ", ".join(f"{key} {value}" for key, value in item.settings.items())
    apart = int(
        np.sqrt(max(best.distance, 0.0))
    )  # not rounded up: what lies 4.5 apart does not decide where 5 do
    says = (
        f"{item.says} ({settings}): the closest two answers would lie {apart} standard deviations"
        f" of the noise apart, which {_sure(best.distance)}{_others(best)}"
    )
    return NextExperiment(item.name, dict(item.settings), names, best.distance, item.text, says)


def _beside(every: Sequence[Judged]) -> Item | None:
    """The two experiments in one file that should set the closest rivals furthest apart, where that
    decides: one tells what another does not.

    Not where it only helps: a regulator that droops showed in fills alone, and no more when strokes
    of as many minutes stood beside them.
    """
    apart = [one for one in every if one.apart]
    pairs = [
        (float(min(np.add(one.apart, two.apart))), one, two) for one, two in combinations(apart, 2)
    ]
    for promised, one, two in sorted(pairs, key=lambda pair: -pair[0]):
        if promised < DECIDES:
            return None
        if (both := joined(one.item, two.item)) is not None:
            return both
    return None


def _others(best: Judged) -> str:
    """What an experiment that does not tell the closest two apart does for the others."""
    return (
        f"; over all pairs they would lie {np.sqrt(best.mean):.0f} apart in the mean, what is"
        " further than 5 counted as 5"
        if best.distance < TELLS <= best.mean
        else ""
    )


def _sure(distance: float) -> str:
    if distance >= DECIDES:
        return (
            "decides (5 do)"
            if distance >= AMPLE
            else "decides (5 do) where the rig is just like one of them"
        )
    return (
        "helps, but does not decide (5 do)"
        if distance >= TELLS
        else "does not tell them apart (5 do), and nothing of the menu would do better"
    )


def _judged(
    rivals: Sequence[Rival],
    item: Item,
    simulate: Simulate,
    distance: Distance,
    beaten_by: Judged | None,
) -> Judged | None:
    """None where it could not be run. Of an experiment that another one beats already, no more
    rivals are asked: each run of the loop costs seconds.
    """
    found: Judged | None = None
    apart: list[float] = []
    for truth in rivals:
        if found is not None and beaten_by is not None and found.reach < beaten_by.reach:
            return found
        recording = simulate(item, truth.plant_text)
        if recording is None:
            return None
        trials_s = recording.period_s * sum(
            span.stop - span.start for span in recording.spans if span.trial
        )
        for other in rivals:
            if other is not truth:
                apart.append(distance(recording, truth, other))
        found = Judged(item, min(apart), trials_s)
    return found._replace(apart=tuple(apart)) if found is not None else None
