"""The verdict in one or two sentences, and what hides in the plant file's own numbers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.bars import BARS
from epa_rt.gap.coverage import Coverage
from epa_rt.gap.diagnosis import Number, Verdict

NONE_EXPLAINS = "no effect of the catalogue explains it"
ELSE = f"something else is missing, and {NONE_EXPLAINS}."


@dataclass(frozen=True)
class Wording:
    """What the sentences speak of. ``sets``: effects that each of ``effects`` cannot be told from.
    ``links``: those with a gap. ``part``, ``whole``: shares explained in the blocks and in free
    run. ``lost``: chi-square above noise in free run where nothing is found. ``faint``: chi-square
    there before and after, where little else speaks for the names; ``over``: where too much of the
    gap stays; ``other_form``: what names that have one form explain in the blocks, where they leave
    something; ``ends``: numbers of the nearest law, with value and unit, that want to go on from
    where it ends.
    """

    verdict: Verdict
    effects: Sequence[str]
    sets: Sequence[Sequence[str]]
    links: Sequence[str]
    part: float
    not_tested: int
    of: int
    odd: Sequence[str] = ()
    whole: float | None = None
    lost: float | None = None
    breaks: Sequence[str] = ()
    faint: tuple[float, float] | None = None
    over: tuple[float, float] | None = None
    other_form: Coverage | None = None
    ends: Sequence[str] = ()

    def said(self) -> str:
        match self.verdict:
            case "no_gap":
                return (
                    "Nothing is left beyond the noise floor once the nominal parameters are"
                    f" refitted; {self.of - self.not_tested} of {self.of} effects would have shown"
                    " at a typical strength."
                )
            case "not_excited":
                return (
                    f"No gap shows, but these logs could not have shown {self.not_tested} of"
                    f" {self.of} effects at a typical strength."
                )
            case "not_in_catalogue":
                return self._of_odd_values() or self._of_the_nearest() or self._of_nothing()
            case "not_separable":
                return f"{self._share()}; this data cannot tell {self._alike()}."
        return self._of_free_run() or (
            f"{self._share()}; the rest is described by data alone."
            if self.verdict == "partly_explained"
            else f"{self._share()}."
        )

    @property
    def names(self) -> str:
        return " and ".join(self.effects)

    @property
    def where(self) -> str:
        return ", ".join(self.links)

    @property
    def _several(self) -> bool:
        return len(self.effects) > 1

    @property
    def _explain(self) -> str:
        return f"{self.names} {'explain' if self._several else 'explains'}"

    def _share(self) -> str:
        return (
            f"{self._explain} {_percent(self.part)} of what can be explained in"
            f" {self.where or 'the residual'}"
        )

    def _alike(self) -> str:
        pairs = [
            (name, ", ".join(alike))
            for name, alike in zip(self.effects, self.sets, strict=True)
            if alike
        ]
        return ", nor ".join(
            f"{name if self._several else 'it'} from {alike}" for name, alike in pairs
        )

    def _of_odd_values(self) -> str | None:
        """What comes nearest has values that are none; None where that is not why nothing is
        named.
        """
        if self.ends:
            return (
                f"What comes nearest ({self.names}) does so only with {', '.join(self.ends)}, where"
                f" its law ends, and would go on from there: {ELSE}"
            )
        if self.odd and not self.where:
            return (
                f"These logs only agree with the plant at values of {', '.join(self.odd)} that"
                f" nobody believes: something like it is missing, and {NONE_EXPLAINS}."
            )
        if self.odd:
            return (
                f"There is a gap in {self.where}; what comes nearest explains it only with values"
                f" of {', '.join(self.odd)} that nobody believes."
            )
        return None

    def _of_the_nearest(self) -> str | None:
        """Why what comes nearest is not it; None where that is for what it leaves in the blocks
        alone, or where nothing comes near.
        """
        if not self.effects:
            return None
        one_by_one = (
            f"{self._explain} {_percent(self.part)} of what the blocks show one by one, but"
        )
        if self.breaks:
            return (
                f"{one_by_one} with {'them' if self._several else 'it'} {', '.join(self.breaks)} no"
                f" longer agrees with the plant, as it did before: {ELSE}"
            )
        if self.whole is not None and self.whole < BARS.carried:
            return f"{one_by_one} in free run {_percent(self.whole)} of the gap: {ELSE}"
        if self.over is not None:
            return (
                f"What comes nearest ({self.names}) leaves in free run a chi-square of"
                f" {self.over[1]:.0f} of {self.over[0]:.0f} above the noise, more than a right law"
                f" leaves of such a gap: {ELSE}"
            )
        if self.other_form:
            return (
                f"The nearest ({self.names}) {'leave' if self._several else 'leaves'}"
                f" {_percent(1.0 - self.other_form.part)} of the gap that the blocks show. A zero,"
                " a scale or a delay of a reading or a command has one formula, so that the right"
                f" one would leave nothing: {ELSE}"
            )
        if self.whole is not None and self.part < BARS.covered:
            return (
                f"{self._explain} {_percent(self.whole)} of the gap in free run, but only"
                f" {_percent(self.part)} of what the blocks show one by one: {ELSE}"
            )
        return None

    def _of_nothing(self) -> str:
        if not self.where and self.lost is not None:
            return (
                "The blocks one by one show no gap, but from its commands alone the plant does not"
                f" follow the rig (chi-square {self.lost:.0f} above its noise): something is"
                f" missing, and {NONE_EXPLAINS}."
            )
        return f"There is a gap in {self.where or 'the residual'}, and {NONE_EXPLAINS}."

    def _of_free_run(self) -> str | None:
        """Where free run speaks for what was found, and the blocks hardly do."""
        if self.where and self.whole is not None and self.part < BARS.covered:
            return (
                f"{self._explain} {_percent(self.whole)} of the gap in free run, from commands to"
                f" readings; one by one the blocks still show something in {self.where}."
            )
        if self.faint is not None:
            return (
                f"{self.names}: faint, but the blocks' fits and free run agree on it (chi-square"
                f" {self.faint[0]:.0f} to {self.faint[1]:.0f} above its noise)."
            )
        if not self.where and self.whole is not None and self.effects:
            return (
                f"{self._explain} {_percent(self.whole)} of the gap in free run; the blocks one by"
                " one show it too faintly to say where."
            )
        return None


def _percent(part: float) -> str:
    return f"{100.0 * float(np.clip(part, 0.0, 1.0)):.0f} %"


def said_of_moved(moved: Sequence[Number]) -> str:
    """What hides in the plant file's own numbers where nothing else shows."""
    return (
        "For that these went further from the plant file than it should be wrong:"
        f" {', '.join(went_to(one) for one in moved)}."
    )


def went_to(moved: Number) -> str:
    """A nominal parameter and where its refit took it; a ratio has no unit to say."""
    return (
        f"{moved.name} to {moved.value:.3g}{'' if moved.unit == '1' else f' {moved.unit}'} (plant"
        f" file: {moved.neutral:.3g})"
    )
