"""The bars of the verdict, in one place."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Bars:
    """Where one verdict ends and the next begins; the figures are from the development cases.

    ``gap``: explainable chi-square per sample from which a link has a gap worth a word, however
    many samples prove it; ``sure``: the same summed over its samples, so that few samples do not
    invent one. ``predictable``: part of a link's excess over the floor that the effects or the
    generic model must foresee on data left out; less is noise that the floor does not know.
    ``alone``: chi-square per sample below which the generic model's word alone is no gap: the
    torque balances of gap-free stand-in rigs reach it. ``noise``: chi-square per sample that the
    method itself may leave of a rig without a gap. ``covered``: part of the excess over that which
    the effects must explain to be the cause, over all links and (``covered_link``) in each that has
    at least ``major`` of the excess; ``carried``: the same of the gap in free run, where more than
    ``little_left`` stays (heard.py: of a small gap a third): right names of four spent sets
    explained 0.928 and more there or left 36 at most, wrong ones 0.916, 0.961 and 0.970 (a bar of
    0.975 refused two right answers of a set that it had not seen, and no wrong one), and of a gap
    of less than ``shapeless`` no more than ``little_left`` may stay: there a formula's shape is
    within the noise (105 right names of three sets left 21 at most, wrong ones 36, 39 and 41; of an
    earlier set an uneven play, whose law is another one since, left 61 of 822); of one law's gap of
    less than ``shapeless_alone`` no more than three quarters of a percent besides (heard.py: 43 of
    44 right ones of three sets with a gap above 1000 left 29 at most, wrong ones 41, 62 and 552).
    ``trifle``: what stays over the noise without being a gap. They are all of it where no more than
    ``small`` is left over the noise, or where they explain ``whole`` of the excess and leave less
    than ``few``, three times the floor: another formula of the right physics leaves that much of a
    large gap, and the simulation then serves; at ten times the floor something real is missing,
    whatever part it is of the gap. ``tested``: expected chi-square of an effect of typical strength
    below which the logs could not have shown it. ``mostly``: part of the catalogue not tested from
    which silence means nothing, and so does the residual of a link of whose effects that many were
    not tested. ``belief``: spreads beyond which a nominal parameter is a gap of its own: no plant
    file is that wrong, so it stands for something else (experiments of little motion alone move
    some by 8); ``belief_named``: the same with effects on, which leave those of little motion where
    they were. ``strain``: sum of squares of all nominal parameters' distances in spreads from which
    the named effects stand for something else: right names of the spent sets left 5 to 30, wrong or
    incomplete ones mostly 42 to 1000; what was further off than ``own`` without them and stays
    there is the plant file's own error and does not count. ``strain_unnamed``: the same where
    nothing is named, of those further off than ``own`` (of 198 answers ``no_gap`` of seven spent
    sets rigs without a gap had 16 at most, rigs that nothing excited 27, effects at one to one and
    a half limits 86 in one parameter and 60 in several; weights on a knee's shin, withheld, 125 to
    177 in its mass, its inertia and its lever). ``shows``: chi-square in free run, where no effect
    is named, from which there is a gap whatever the links say (gap-free rigs leave 3 to 28, weak
    effects up to 73, pressures that no noise dithers once 126 in 25 sets; withheld heat of a motor
    120, weights on a knee's shin 129, 170 and 183). ``unshown``: the same up to which what links
    say is the method's own. ``heard_of``: confidence below which a name is none that free run is no
    better with. ``quiet``: chi-square per sample that 14 gap-free rigs left (1.25 in the load's
    link, less in all others); ``strict``: how many times what is left counts against a name's
    confidence. ``strict_whole``: the same of what is left of the gap in free run, where the right
    law in other words leaves 0.02 and creep for the bladder's wall left 0.04. ``no_trust``:
    confidence below which a name is no answer where the whole plant shows a gap. ``loud``: times
    its floor from which a link of a rig without a model of the whole has a gap though nothing
    measured foresees it (a hand on a carriage: 6.6 to 14); ``loud_beside_sensors``: the same where
    the floor is of the sensors alone (a carriage without a gap: 1.56). ``exact``: part of the
    excess that all names together must explain, in the links that they have to do with, where each
    is a zero, a scale or a shift in time of a reading or a command, which has no other form (right
    ones of two sets 0.995 and more, an encoder's age for a late command 0.92, with 24 of 11 207
    left in free run). ``breaks``: chi-square per sample by which a link that was content may grow
    with the effects on; ``touched``: part of a link's excess of which effects must explain more to
    have to do with it.
    """

    gap: float = 0.05
    sure: float = 300.0
    predictable: float = 0.2
    alone: float = 1.6
    noise: float = 1.4
    covered: float = 0.7
    covered_link: float = 0.65
    carried: float = 0.92
    little_left: float = 30.0
    shapeless: float = 1000.0
    shapeless_alone: float = 15e3
    major: float = 0.1
    trifle: float = 0.5
    whole: float = 0.9
    few: float = 8.0
    small: float = 1.0
    tested: float = 40.0
    mostly: float = 0.6
    belief: float = 12.0
    belief_named: float = 6.0
    strain: float = 40.0
    strain_unnamed: float = 100.0
    own: float = 3.0
    unshown: float = 60.0
    shows: float = 100.0
    heard_of: float = 0.2
    quiet: float = 1.2
    strict: float = 3.0
    strict_whole: float = 10.0
    no_trust: float = 0.05
    loud: float = 2.0
    loud_beside_sensors: float = 3.0
    exact: float = 0.97
    breaks: float = 1.0
    touched: float = 0.3


BARS = Bars()
