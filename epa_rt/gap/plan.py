"""What next: the experiment that tells apart best what the data at hand cannot, found by simulating every rival.

A rival's own plant makes the data of the experiment; every other rival is refitted to it, nominal parameters and all. What
is left then, in units of the noise, is the distance that the experiment would put between them.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from epa_rt.gap.diagnosis import NextExperiment
from epa_rt.gap.menu import Item
from epa_rt.gap.recording import Recording

DECIDES = 25.0     # chi-square between two rivals that settles the matter: five standard deviations of the noise
TELLS = 10.0       # by less no two answers are told apart: what separate.py takes for chance
LONGEST_S = 240.0  # of trials, to which an experiment that does not decide is drawn out: nobody waits longer, and a diagnosis takes no more


class Rival(NamedTuple):
    """One of several answers that fit alike: its effects' names, and the plant file that has them."""

    names: tuple[str, ...]
    plant_text: str


Simulate = Callable[[Item, str], Recording | None]           # experiment, plant text; None where the run did not complete
Distance = Callable[[Recording, Rival, Rival], float]        # data made by the first, chi-square of the second over the first


def next_experiment(rivals: Sequence[Rival], items: Sequence[Item], simulate: Simulate, distance: Distance,
                    progress: Callable[[str, float], None] = lambda stage, share: None) -> NextExperiment | None:
    """The experiment with the largest least distance between any two rivals, with more rounds where one does not decide; None where none could be simulated."""
    judged: list[tuple[float, Item]] = []
    for k, item in enumerate(items):
        progress(f"next experiment: {item.name} {' '.join(item.settings.values())}", k / (len(items) + 1))
        found = _least_distance(rivals, item, simulate, distance, max((best for best, _ in judged), default=-np.inf))
        if found is not None:
            judged.append((found, item))
    if not judged:
        return None
    best, item = max(judged, key=lambda pair: pair[0])
    longer = _longer(item, best, simulate, rivals[0])
    if longer is not None:
        progress(f"next experiment: {longer.name} {' '.join(longer.settings.values())}", 1.0 - 1.0 / (len(items) + 1))
        found = _least_distance(rivals, longer, simulate, distance, best)
        best, item = (found, longer) if found is not None and found > best else (best, item)
    names = tuple(dict.fromkeys(name for rival in rivals for name in rival.names))
    settings = ", ".join(f"{key} {value}" for key, value in item.settings.items())
    says = f"{item.says} ({settings}): the closest two answers would lie {np.sqrt(max(best, 0.0)):.0f} standard deviations of the noise apart, which {_sure(best)}"
    return NextExperiment(item.name, dict(item.settings), names, best, item.text, says)


def _sure(distance: float) -> str:
    if distance >= DECIDES:
        return "decides (5 do)"
    return "helps, but does not decide (5 do)" if distance >= TELLS else "does not tell them apart (5 do), and nothing of the menu would do better"


def _longer(item: Item, distance: float, simulate: Simulate, truth: Rival) -> Item | None:
    """The same experiment in as many rounds as should decide twice over; None where it decides as it is, or not even the longest would tell.

    Distances grow as the trials do, as long as noise is all that hides them.
    """
    if distance >= DECIDES or item.rounds is None or distance <= 0.0:
        return None
    recording = simulate(item, truth.plant_text)
    seconds = 0.0 if recording is None else sum(span.stop - span.start for span in recording.spans if span.trial) * recording.period_s
    most = int(LONGEST_S / seconds) if seconds > 0.0 else 0
    times = min(int(np.ceil(2.0 * DECIDES / distance)), most)
    return item.rounds(times) if times > 1 and times * distance >= TELLS else None


def _least_distance(rivals: Sequence[Rival], item: Item, simulate: Simulate, distance: Distance, beaten_by: float) -> float | None:
    """Of an experiment that another one beats already, no more rivals are asked: each run of the loop costs seconds."""
    least = None
    for truth in rivals:
        if least is not None and least <= beaten_by:
            return least
        recording = simulate(item, truth.plant_text)
        if recording is None:
            return None
        for other in rivals:
            if other is not truth:
                found = distance(recording, truth, other)
                least = found if least is None else min(least, found)
    return least
