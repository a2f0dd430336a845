"""What a diagnosis says, field by field, as the JSON of ``epa gap diagnose`` has it."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Literal

Verdict = Literal[
    "no_gap", "explained", "partly_explained", "not_in_catalogue", "not_excited", "not_separable"
]
Mode = Literal["teacher_forced", "free_run"]
Baseline = Literal["refitted", "plant_file"]
Who = Literal["rig", "plant_file", "both"]
SILENT = ("no_gap", "not_excited")  # verdicts that say of no place that anything is wrong

# chi-square between two answers that settles the matter: five standard deviations of the noise
DECIDES = 25.0
TELLS = 10.0  # by less no two answers are told apart

GAIN = 100.0  # chi-square that a place must explain for a gap to come from there
NEAR = 0.5  # of what the first one explains, without which no place comes near
APART = 2.0  # deviations over the blocks from which a place is behind the first
# chi-square by which a place is not behind: on 36 rigs without a gap places explained up to 343 of
# what the method leaves there
MISFIT = 350.0


@dataclass(frozen=True)
class Place:
    """Where the gap lies: a link's (in free run a reading's) excess over its noise floor, ranked by
    significance.
    """

    block: str
    link: str
    channel: str
    unit: str
    rms: float  # of the residual after the nominal parameters have been refitted
    floor: float  # rms of the noise floor
    excess: float  # sqrt(rms^2 - floor^2), 0 where below
    times_floor: float
    significance: float  # z of the excess; above 4 is beyond doubt
    state: dict[
        str, float
    ]  # region ("speed > 0", "reversal", "pressure high") to its excess over floor
    band_hz: dict[str, float]  # "0.1-0.3" to excess over floor
    time_s: dict[str, float]  # "LOG 0-10" to excess over floor


@dataclass(frozen=True)
class Number:
    """A parameter with its unit and its 95 % interval; ``neutral`` is what the plant file says: of
    an effect that it lacks, the value without it.
    """

    name: str
    value: float
    unit: str
    low: float
    high: float
    neutral: float
    # whether the value stands where its law's range ends, and neither as in the plant file nor
    # absent
    at_end: bool = False


@dataclass(frozen=True)
class Named:
    """An effect that the diagnosis names, best first."""

    name: str
    family: str
    block: str
    parameters: tuple[Number, ...]
    confidence: float  # 0 to 1: probability that the rig has an effect of its family
    gain: float  # fall of chi-square with what is named, on the logs that it was fitted to
    not_separable_from: tuple[str, ...] = ()
    # has it: the rig alone, the plant file alone (it is to be taken out), or both at other
    # strengths
    who: Who = "rig"
    in_more_numbers: tuple[
        str, ...
    ] = ()  # laws of its family with more numbers that were fitted and have become it
    # its strength in each log that shows it, named by the log, all else as in all of them
    by_log: tuple[Number, ...] = ()


@dataclass(frozen=True)
class Shrinkage:
    """How far the gap of one channel shrinks; ``closed_share`` is 1 - (after^2 - floor^2)/(before^2
    - floor^2), unclipped.
    """

    channel: str
    unit: str
    mode: Mode
    log: str  # held-out log, or "all"
    before: float
    after: float
    floor: float
    closed_share: float | None  # None where there was no gap to close
    interval: tuple[float, float] | None
    times_floor: float
    floor_source: str  # "repeats", "twin", "sensors"
    # "before": nominal parameters refitted without the effects, or the plant file as it stands
    baseline: Baseline = "refitted"


@dataclass(frozen=True)
class Remainder:
    """What is left after the named effects, described by data alone."""

    link: str
    channel: str
    unit: str
    rms: float
    floor: float
    depends_on: tuple[
        tuple[str, float], ...
        # feature and share of the excess that it explains, ranked; above 1 where that goes below
        # the floor
    ]
    explained_share: float  # by the generic model, of the excess, on held-out spans
    coverage: float | None  # shrink(named effects) / shrink(generic model)


@dataclass(frozen=True)
class NextExperiment:
    """The experiment that would tell apart what this data cannot."""

    name: str
    settings: dict[str, str]
    separates: tuple[str, ...]  # effects that stand in some of the answers and not in all
    expected_distance: (
        float  # chi-square between the two best fits on the new data; above 25 decides
    )
    file: str  # text of an experiment file for ``epa run``
    says: str

    @property
    def tells(self) -> bool:
        """Whether it should tell the closest two answers apart at all."""
        return self.expected_distance >= TELLS


@dataclass(frozen=True)
class Origin:
    """What an error of one place, whatever its law, explains of a gap that no effect does."""

    place: str  # "force_cell"
    block: str
    says: str  # "the reading of the force"
    gain: float  # chi-square on trials that the error's fit has not seen
    explained_share: (
        float  # that gain over the excess over noise and what nominal parameters are strained by
    )
    behind: float  # deviations over the logs' blocks behind the place that explains most


def likely(found: Sequence[Origin]) -> tuple[Origin, ...]:
    """The places that a gap comes from, as far as its links can be told from others'; none where no
    place explains it.
    """
    if not found or found[0].gain < GAIN:
        return ()
    return tuple(
        one
        for one in found
        if one.gain > NEAR * found[0].gain
        and (one.behind < APART or found[0].gain - one.gain < MISFIT)
    )


@dataclass(frozen=True)
class FreeRun:
    """What the whole plant says that runs from the commands alone, in chi-square above noise and
    steps, four readings a second.
    """

    gap: float  # without any effect, nominal parameters fitted
    left: float  # with the effects that come nearest
    explained_share: float | None  # None where there is no gap in free run
    nearest: tuple[str, ...]  # those effects


@dataclass(frozen=True)
class Could:
    """A set of effects that the rig may have and the plant file lacks; empty: none of the
    catalogue. ``left_share``: of the gap, as ``Posterior.judged_by`` shows it, that it leaves; None
    where there is no gap.
    """

    effects: tuple[str, ...]
    probability: float
    left_share: float | None


PosteriorVerdict = Literal[
    "no_gap", "explained", "partly_explained", "not_separable", "not_in_catalogue"
]


@dataclass(frozen=True)
class Posterior:
    """What it could be. ``models``: the most probable first, until they hold 0.99 together with
    ``unknown``: the probability of something that the catalogue lacks. ``families``: probability
    that the rig has an effect of each, the most probable first, from 0.01 on. ``judged_by``: the
    view that shows most of the gap ("blocks", "free_run").

    ``verdict``: the answer that costs least on these probabilities; ``names``: what it names, with
    the probability of each name's family; ``instead``: sets that are probable as well.
    ``calibrated_on``: sealed cases of simulated rigs that the numbers behind it were fitted to,
    ``recordings``: recordings of others.
    """

    models: tuple[Could, ...]
    families: dict[str, float]
    unknown: float
    judged_by: str
    verdict: PosteriorVerdict
    names: dict[str, float]
    instead: tuple[tuple[str, ...], ...]
    calibrated_on: int
    recordings: int = 0

    @property
    def none(self) -> float:
        """Probability that nothing is missing."""
        return next((one.probability for one in self.models if not one.effects), 0.0)

    @property
    def leaves_open(self) -> bool:
        """Whether nothing is named although that is not what is most probable: a wrong name costs
        more than none. Something is more probably missing than not, or a family's law than none.
        """
        if self.verdict == "no_gap":
            return self.none < 1.0 - self.none
        best = next(iter(self.families.values()), 0.0)
        return self.verdict == "not_in_catalogue" and best > self.unknown


@dataclass(frozen=True)
class Change:
    """A number of the plant now and in the runs of a baseline. ``spread``: deviation of the mean of
    as many more healthy runs; ``spreads``: by how many of it the number has moved.
    """

    name: str
    unit: str
    before: float
    spread: float
    now: float
    spreads: float


@dataclass(frozen=True)
class Onset:
    """An effect that begins, or changes its strength, within a log. ``on``: whether it was on
    before. ``lasts``: to the end of that log, or of all later ones.
    """

    effect: str
    on: bool
    log: str
    at_s: float
    within_s: float  # how finely it was looked for
    lasts: Literal["log", "logs"]
    number: str
    unit: str
    before: float
    after: float
    explained_share: float  # of what is left without it, block by block
    probability: float


@dataclass(frozen=True)
class Diagnosis:
    """The whole answer."""

    verdict: Verdict
    says: str  # the verdict in one or two sentences
    found_first: tuple[str, ...] = ()  # what hygiene found; said before any effect
    location: tuple[Place, ...] = ()
    effects: tuple[Named, ...] = ()
    nominal_moved: tuple[Number, ...] = ()  # of ``nominal``, further than anybody believed
    not_tested: tuple[str, ...] = ()  # effects that these logs could not have shown
    shrinkage: tuple[Shrinkage, ...] = ()
    remainder: tuple[Remainder, ...] = ()
    next_experiment: NextExperiment | None = None
    free_run: FreeRun | None = None  # None where the rig has no model of the whole
    free_run_location: tuple[
        Place, ...
        # reading by reading, run from the commands alone with the nominal parameters fitted to that
    ] = ()
    origins: tuple[
        Origin, ...
    ] = ()  # where the gap may come from, the likeliest first; only with not_in_catalogue
    posterior: Posterior | None = None  # None for an answer that was not decided by one
    gate: dict | None = None
    refitted: dict[str, float] = field(
        default_factory=dict
    )  # knob key to value, nominal parameters refitted without the effects
    fitted: dict[str, float] = field(
        default_factory=dict
    )  # the same with the effects: all that a patched plant file differs in
    seconds: float = 0.0
    inputs: dict = field(
        default_factory=dict
    )  # rig, plant, logs, held-out logs, catalogue left out
    onset: Onset | None = None  # within a log, where one is likelier than none
    changes: tuple[Change, ...] = ()  # since the baseline, the furthest first; only with one
    nominal: tuple[Number, ...] = ()  # the plant file's own numbers, as fitted beside the effects

    def as_json(self) -> dict:
        return asdict(self)
