"""A drive whose loop is its maker's own: what is left out, what the rest may say, and how both
stand in one answer.
"""

from dataclasses import replace
from types import SimpleNamespace as Thing

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.own_loop import UNHEARD, Rest, apart, joined, judged_by
from tests.gap.report.answers import EXPLAINED, NOT_IN_CATALOGUE
from tests.gap.test_verdict import left
from tests.gap.toy import Toy, floors, recording

OWN = "drive"


class Maker(Toy):
    own_loop = (OWN, "encoder")


def found(after=None, z=(0.5, 0.5), **links: tuple[float, float]):
    """``z``: nominal parameters with the effects on, in spreads."""
    base, final = (
        Thing(normal=Thing(keys=("a", "b"), z=np.array(at), prior=np.ones(2)))
        for at in ((0.5, 0.5), z)
    )
    return Thing(
        before=left(**links),
        after=left(**(after or links)),
        selection=Thing(base=base, final=final),
    )


def test_the_rest_knows_no_effect_and_no_number_that_the_left_out_link_alone_shows():
    rest = Rest(Maker(), OWN)
    assert [link.name for link in rest.links] == ["gas", "spring"]
    assert {"leak", "dahl", "pressure_offset"} <= {effect.name for effect in rest.catalogue}
    assert not {"motor_friction", "cogging", "current_offset"} & {
        effect.name for effect in rest.catalogue
    }
    assert (
        not any(knob.key.startswith("drive.") for knob in rest.nominal)
        and rest.touched("drive.gain_a") == ()
    )


def test_the_rest_is_asked_where_most_of_an_unexplained_gap_is_in_the_drives_own_loop():
    loud = found(drive=(900.0, 1.2), gas=(20.0, 1.1), spring=(1.0, 1.0))
    assert isinstance(apart(Maker(), loud, NOT_IN_CATALOGUE), Rest)
    assert apart(Maker(), loud, EXPLAINED) is None
    assert apart(Toy(), loud, NOT_IN_CATALOGUE) is None, "no loop of a maker's"
    assert apart(Maker(), found(drive=(900.0, 1.2), gas=(1.0, 1.0)), NOT_IN_CATALOGUE) is None, (
        "nothing else to be explained"
    )
    assert (
        apart(
            Maker(),
            found(drive=(900.0, 1.2), encoder=(20.0, 1.1), gas=(20.0, 1.1)),
            NOT_IN_CATALOGUE,
        )
        is None
    ), "the motion itself is in doubt"
    assert apart(Maker(), found(drive=(20.0, 1.1), gas=(900.0, 1.2)), NOT_IN_CATALOGUE) is None, (
        "the drive may show what is wrong in the gas"
    )
    late = {"drive": (1.02, 1.0), "gas": (18.0, 1.1)}
    assert (
        apart(Maker(), found(late, drive=(900.0, 1.2), gas=(20.0, 1.1)), NOT_IN_CATALOGUE) is None
    ), "an effect explains the drive"
    assert apart(
        Maker(), found(late, (5.0, 6.0), drive=(900.0, 1.2), gas=(20.0, 1.1)), NOT_IN_CATALOGUE
    ), "with parameters that nobody believes"


def test_what_the_rest_says_counts_less_and_hides_nothing_of_the_drive():
    drive = replace(EXPLAINED.location[-1], link=OWN, block=OWN, times_floor=44.0)
    whole = replace(
        NOT_IN_CATALOGUE, location=(replace(drive, block="spring"), drive, *EXPLAINED.location[:-1])
    )
    said = joined(whole, EXPLAINED, OWN, ("cogging",))
    assert said.verdict == "partly_explained" and said.says.startswith(
        "The drive's own loop is not the plant file's (44.0 times its floor)"
    )
    assert said.effects[0].name == EXPLAINED.effects[0].name and said.effects[
        0
    ].confidence == pytest.approx(UNHEARD * EXPLAINED.effects[0].confidence)
    assert said.location == (drive, *EXPLAINED.location) and said.free_run == whole.free_run
    assert said.not_tested == (*EXPLAINED.not_tested, "cogging")


@pytest.mark.parametrize(
    "rest",
    [
        NOT_IN_CATALOGUE,
        replace(EXPLAINED, verdict="not_separable"),
        replace(EXPLAINED, effects=(replace(EXPLAINED.effects[0], confidence=0.45),)),
    ],
)
def test_a_rest_that_is_not_sure_of_a_name_changes_nothing(rest):
    assert joined(NOT_IN_CATALOGUE, rest, OWN) is NOT_IN_CATALOGUE


def test_friction_is_named_beside_a_drive_that_nothing_explains():
    """A current that swings over the command, of which no effect knows."""
    logs = [
        recording(
            f"log{i}",
            i,
            {"spring.dahl_n": 2.0},
            extra=lambda c: {OWN: 0.4 * np.sin(12.0 * c["command_v"])},
        )
        for i in range(3)
    ]
    told = diagnose(Maker(), logs, floors=floors)
    assert (
        [effect.name for effect in told.effects] == ["dahl"]
        and told.effects[0].confidence <= UNHEARD
        and told.verdict == "partly_explained"
    )
    assert told.location[0].link == OWN
    by = judged_by(told, Maker())
    assert isinstance(by, Rest) and [link.name for link in by.links] == ["gas", "spring"]
    assert not diagnose(Toy(), logs, floors=floors).effects
