"""What stands for and against the names that were found: what shows, what they explain, what they
leave, break or pass over.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from epa_rt.gap.attribution import Attribution
from epa_rt.gap.bars import BARS
from epa_rt.gap.coverage import Coverage, broken, coverage, gaps, passed_over, trust
from epa_rt.gap.diagnosis import Named, Verdict
from epa_rt.gap.doubts import UNSUPPORTED, doubted, doubts
from epa_rt.gap.heard import Heard
from epa_rt.gap.plausible import absorbed, beyond_belief, beyond_belief_together, strained
from epa_rt.gap.verdict import Evidence, decided, informed, untested
from epa_rt.gap.whose import spoken
from epa_rt.gap.wording import Wording

# of it where the whole plant follows its commands to the noise, though a block is not content; and
# where all that speaks for a name is faint
FOLLOWED = 0.5


@dataclass(frozen=True)
class Weighed:
    """``silent``: effects that these logs could not have shown. ``where``: links with a gap that
    can be foreseen. ``odd``: parameters beyond belief, nominal ones or a law's own. ``breaks``:
    links that agreed with the plant and no longer do. ``passed``: links with a gap of which the
    names explain next to nothing. ``there``: what free run says of the names, None where none is
    found or the rig has no model of the whole. ``lost``: chi-square above noise there where nothing
    is found. ``lifted``: whether something speaks for the names that what the blocks leave does not
    count against.
    """

    found: Attribution
    silent: tuple[str, ...]
    where: tuple[str, ...]
    covered: Coverage
    odd: tuple[str, ...]
    breaks: tuple[str, ...]
    passed: tuple[str, ...]
    there: Heard | None
    lost: float | None
    lifted: bool

    @property
    def to_noise(self) -> bool:
        return self.there is not None and self.there.to_noise

    @property
    def elsewhere(self) -> tuple[str, ...]:
        """Links that were passed over, where names are given and the whole plant does not follow
        them to the noise.
        """
        return self.passed if self.found.selection.roles and not self.to_noise else ()

    @property
    def helps(self) -> bool:
        return self.there is not None and self.there.helps

    @property
    def whole(self) -> float | None:
        return self.found.heard.part if self.found.heard else None

    @property
    def counted(self) -> float | None:
        return self.found.heard.counted if self.found.heard else None

    @property
    def trusted(self) -> float:
        """What a name's share of the resamples counts."""
        all_of_it = trust(self.found.before, self.found.after, self.whole) * (
            UNSUPPORTED if doubted(self.found.heard) else 1.0
        )
        all_of_it = max(all_of_it, FOLLOWED) if self.lifted else all_of_it
        return all_of_it * (UNSUPPORTED if self.elsewhere else 1.0)

    @property
    def doubts(self) -> tuple[str, ...]:
        return doubts(None if self.lifted else self.there, self.elsewhere)

    @property
    def ends(self) -> tuple[str, ...]:
        """Numbers of the named laws that want to go on from where these end, as a person reads
        them, where that is what is odd about the names.
        """
        pressed = self.there.pressed if self.there is not None else {}
        if self.odd != tuple(pressed):
            return ()
        return tuple(
            f"{key} at {value:.3g} {self.found.problem.knobs[key].unit}"
            for key, value in pressed.items()
        )

    def verdict(self, names: Sequence[Named]) -> tuple[Verdict, str]:
        """The verdict, and the sentences that say it."""
        effects, there = self.found.problem.effects, self.there
        rivals = [
            [law for law in one.not_separable_from if effects[law].family != one.family]
            for one in names
        ]
        over = there is not None and there.too_much_left
        evidence = Evidence(
            gap=bool(self.where),
            effects=[one.name for one in names],
            found=self.covered,
            ambiguous=any(rivals),
            untested=len(self.silent) / max(len(effects), 1),
            odd=bool(self.odd),
            whole=self.counted,
            lost=self.lost,
            to_noise=self.to_noise,
            breaks=bool(self.breaks),
            elsewhere=bool(self.elsewhere),
            helps=self.helps,
            trust=trust(self.found.before, self.found.after, self.counted),
            too_much_left=over,
            groundless=groundless(names, there),
            exact=(
                coverage(self.found.before, self.found.after, but=self.passed)
                if there is not None and there.exact
                else None
            ),
        )
        verdict = decided(evidence)
        shown = (there.gap, there.left) if there else None
        faint = (
            shown
            if self.helps and self.whole is None and self.covered.part < BARS.covered
            else None
        )
        says = Wording(
            verdict,
            [spoken(one) for one in names],
            rivals,
            self.where,
            self.covered.part,
            len(self.silent),
            len(effects),
            odd=self.odd,
            whole=self.counted,
            lost=self.lost,
            breaks=self.breaks,
            faint=faint,
            over=shown if over else None,
            other_form=evidence.exact if evidence.other_form(BARS) else None,
            ends=self.ends,
        )
        return verdict, says.said()


def groundless(names: Sequence[Named], there: Heard | None) -> bool:
    """Whether nothing speaks for any of the names: they are hardly ever first and the whole plant
    is no better with them, or, of a rig without a model of the whole, none has any confidence (a
    rise towards standstill of a shaft without a gap was `explained` with none).
    """
    if there is None:
        return all(one.confidence < BARS.no_trust for one in names)
    return not there.supports and all(one.confidence < BARS.heard_of for one in names)


def weighed(found: Attribution) -> Weighed:
    """What stands for and against what was found, before any of it is named."""
    problem, selection, names = found.problem, found.selection, found.selection.roles
    screening = (
        names[0].screening if names else selection.refused.screening if selection.refused else None
    )
    silent = untested(screening.typical() if screening else {}, tuple(problem.effects))
    judged = informed(
        {
            link: [e.name for e in problem.effects.values() if link in problem.touched(e.knobs)]
            for link in problem.links
        },
        silent,
    )
    there = found.heard if names else None
    lost = found.heard.left if found.heard and not names else None
    where = (
        ()
        if lost is not None and lost <= BARS.unshown
        else tuple(link for link in gaps(found.before, found.after) if link in judged)
    )
    to_noise = there is not None and there.to_noise
    unplaced = (
        not where
        and found.heard is not None
        and found.heard.counted is not None
        and found.heard.counted >= BARS.carried
    )  # no block has a gap, and free run's is explained
    faint = there is not None and there.helps and there.part is None
    return Weighed(
        found,
        silent,
        where,
        coverage(found.before, found.after),
        _odd(found),
        breaks=broken(found.before, found.after) if names else (),
        passed=passed_over(found.before, found.after),
        there=there,
        lost=lost,
        lifted=to_noise or unplaced or faint,
    )


def _odd(found: Attribution) -> tuple[str, ...]:
    """Nominal parameters beyond belief: where effects are named those that hide more than the
    effects explain, or that are further off together than plant files are; and numbers of the
    effects that want to go on from where their laws end.

    Where free run finds values for the whole plant that a plant file may have, that is enough. A
    wrong law drives them there to make up for what it lacks; with the right one they come back.
    """
    roles = found.selection.roles
    if not roles:
        return beyond_belief(found.selection.base.normal) or beyond_belief_together(
            found.selection.base.normal
        )
    normal = found.selection.final.normal
    odd = beyond_belief(normal, BARS.belief_named)
    if absorbed(normal, odd) > sum(float(role.gains[0].sum()) for role in roles):
        return odd
    if found.heard and found.heard.borne:
        return tuple(found.heard.pressed)
    return strained(found.selection.base.normal, normal)
