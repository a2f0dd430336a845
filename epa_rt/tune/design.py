"""Gains for a loop from its plant's measured response: the best disturbance rejection and tracking
under a bound on the sensitivity peak over the response's uncertainty.

Fixed structure on a nonparametric response, bound on |S| at every frequency: Karimi and Galdos,
Automatica 46 (2010) 1388; Ms of 1.4 to 2 as the measure of robustness, 1.6 the usual middle:
Astrom and Hagglund, Advanced PID Control (2006), 6 and 7.
"""

from dataclasses import dataclass, replace

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.tune.controller import JOINT, MOTOR, Controller, Gains, Loop, controller_of, rounded
from epa_rt.tune.followed import Followed
from epa_rt.tune.margins import QUIET, Interpolated, Margins, is_stable, margins_of

MS_LIMIT = 1.6
SPARE = 0.95  # of each bound: gains are rounded, and a plant differs with amplitude
# of the motor's top speed (joint) and acceleration (motor): how much the sensor's steps may make
# the command hum, where the present gains do not allow more
NOISE_SHARE = {JOINT: 0.01, MOTOR: 0.05}
BIG = 1e6
CUTOFFS_HZ = (5.0, 80.0)  # between the mechanics and what an experiment may excite


@dataclass(frozen=True)
class Wanted:
    """What the loop is to follow: power of the reference (unit^2) at frequencies (k,) in Hz."""

    frequency_hz: np.ndarray
    power: np.ndarray


@dataclass(frozen=True)
class Merit:
    """What gains are worth: ``tracking`` RMS error of the wanted reference (unit of the output),
    ``load`` RMS of the output after a unit step of the command (unit x s^0.5), ``noise_rate`` RMS
    rate of the command that the steps of the sensor cause (per s).
    """

    tracking: float
    load: float
    noise_rate: float


@dataclass(frozen=True)
class Problem:
    """A loop, its plant on a fine grid, what is wanted of it, and the noise that is allowed.

    ``kp_max``: beyond it a reading that is renewed late makes the command jump further than its
    slew limit lets it. ``followed``: a trial of the wanted motion; None where none was recorded.
    """

    loop: Loop
    plant: Interpolated
    wanted: Wanted
    quantum: float
    noise_rate_max: float
    kp_max: float = float("inf")
    followed: Followed | None = None

    def margins(self, gains: Gains) -> Margins:
        """Margins with these gains."""
        return margins_of(self.plant, self._on_grid(gains).feedback)

    def merit(self, gains: Gains) -> Merit:
        """What these gains are worth, stable or not."""
        frequency, controller = self.plant.frequency_hz, self._on_grid(gains)
        sensitivity = 1.0 / (1.0 + self.plant.plant * controller.feedback)
        omega = 2.0 * np.pi * frequency
        answer = np.abs(self.plant.plant * sensitivity) ** 2 / omega**2
        load = np.sqrt(np.trapezoid(answer, frequency) * 2.0)
        return Merit(
            self._tracking(gains), float(load), self._noise_rate(gains, controller, sensitivity)
        )

    def _on_grid(self, gains: Gains) -> Controller:
        return controller_of(self.loop, gains, self.plant.frequency_hz)

    def _tracking(self, gains: Gains) -> float:
        """RMS error of the recorded trial with these gains, or by the response alone."""
        if self.followed is not None:
            return self.followed.tracking(gains)
        return float(np.sqrt(np.sum(self._errors(gains) * self.wanted.power)))

    def _errors(self, gains: Gains) -> np.ndarray:
        """|error per reference|^2 (k,) at the wanted frequencies."""
        plant = self.wanted_plant
        controller = controller_of(self.loop, gains, self.wanted.frequency_hz)
        error: np.ndarray = 1.0 - plant * controller.forward / (1.0 + plant * controller.feedback)
        squared: np.ndarray = np.abs(error) ** 2
        return squared

    @property
    def wanted_plant(self) -> np.ndarray:
        """The plant (k,) at the wanted frequencies; below the lowest known as there, or as an
        integrator for a motor's travel.
        """
        known, at = np.log(self.plant.frequency_hz), np.log(self.wanted.frequency_hz)
        size = np.exp(np.interp(at, known, np.log(np.abs(self.plant.plant))))
        phase = np.interp(at, known, np.unwrap(np.angle(self.plant.plant)))
        if self.loop.kind != JOINT:
            size = size * np.maximum(self.plant.frequency_hz[0] / self.wanted.frequency_hz, 1.0)
        plant: np.ndarray = size * np.exp(1j * phase)
        return plant

    def _noise_rate(self, gains: Gains, controller: Controller, sensitivity: np.ndarray) -> float:
        """White rounding of one step goes through controller and loop; beyond the frequencies known
        the loop is open.
        """
        frequency, density = self.plant.frequency_hz, self.quantum**2 / 12 * 2 * self.loop.period_s
        inside = np.abs(2.0 * np.pi * frequency * controller.feedback * sensitivity) ** 2
        beyond = np.geomspace(frequency[-1], 0.499 / self.loop.period_s, 120)
        open_loop = controller_of(self.loop, gains, beyond).feedback
        outside = np.abs(2.0 * np.pi * beyond * open_loop) ** 2
        total = np.trapezoid(inside, frequency) + np.trapezoid(outside, beyond)
        return float(np.sqrt(total * density))

    def holds(self, gains: Gains) -> bool:
        """Whether these gains keep every bound: Ms over the uncertainty, loop gain at the highest
        frequency known, noise.
        """
        return self.excess(gains) <= 0.0

    def excess(self, gains: Gains, spare: float = 1.0) -> float:
        """By how much these gains break ``spare`` of a bound, as a share of it; zero or less where
        none is broken.
        """
        plant, controller = self.plant, self._on_grid(gains)
        loop = plant.plant * controller.feedback
        reach = np.min(np.abs(1.0 + loop) - np.abs(controller.feedback) * plant.radius)
        noise = self._noise_rate(gains, controller, 1.0 / (1.0 + loop))
        excesses = (
            1.0 - reach * MS_LIMIT * spare,
            float(np.abs(loop[-1])) / (QUIET * spare) - 1.0,
            noise / (self.noise_rate_max * spare) - 1.0,
            gains.kp / (self.kp_max * spare) - 1.0,
            0.0 if is_stable(loop) else 1.0 + float(np.max(np.abs(loop))),
        )
        return max(excesses) if excesses[-1] == 0.0 else excesses[-1]

    def with_feedforward(self, gains: Gains) -> Gains:
        """The same feedback with the feedforward that the recorded trial asks for.

        Without a trial of the wanted motion it gives back what the derivative brakes: the command
        that the motion asks for stays the present one. The derivative brakes by
        kd s / (1 + s / (2 pi cut-off)), whose first two powers of s speed and acceleration cancel.
        So the error is the present one times the ratio of the sensitivities, whatever the plant
        does at the size of the wanted motion. The motor's loop has none.
        """
        if self.loop.kind != JOINT:
            return gains
        given_back = self._with_derivative_given_back(gains)
        if self.followed is None:
            return given_back
        return self.followed.with_feedforward(given_back)

    def _with_derivative_given_back(self, gains: Gains) -> Gains:
        present = self.loop.gains
        return replace(
            gains,
            feedforward_speed_s=present.feedforward_speed_s + gains.kd - present.kd,
            feedforward_acceleration_s2=present.feedforward_acceleration_s2
            + _lagging(present)
            - _lagging(gains),
        )


def _lagging(gains: Gains) -> float:
    """The derivative times the lag of its filter, in s^2."""
    return gains.kd / (2.0 * float(np.pi) * gains.derivative_cutoff_hz)


@dataclass(frozen=True)
class Proposal:
    """What is proposed: ``gains`` equal to the present ones where ``keep``; ``why`` a sentence.
    ``known``: whether the response says enough to judge either. ``holding``: of present gains that
    stay although they break a bound, those that keep every bound at the least cost.
    """

    gains: Gains
    keep: bool
    why: str
    known: bool = True
    holding: Gains | None = None


WORTH = 0.10  # less gain than this is not worth a change of a rig that runs


def problem_of(
    rig: Rig,
    loop: Loop,
    plant: Interpolated,
    wanted: Wanted,
    quantum: float,
    followed: Followed | None = None,
) -> Problem:
    """The problem with the noise that the present gains or NOISE_SHARE allow. ``quantum``: one step
    of the measured output, ``followed``: a trial of what is wanted.
    """
    top = rig.motor.speed_max if loop.kind == JOINT else rig.motor.acceleration_max
    free = Problem(loop, plant, wanted, quantum, float("inf"), followed=followed)
    present = free.merit(loop.gains).noise_rate
    return replace(
        free,
        noise_rate_max=max(present, NOISE_SHARE[loop.kind] * top),
        kp_max=max(_held_reading(rig, loop), loop.gains.kp),
    )


def _held_reading(rig: Rig, loop: Loop) -> float:
    """The motor's gain at which, at its top speed, one renewal of a held position takes the whole
    slew limit of a cycle; infinite where a position is new in every cycle.
    """
    held_s, slew = rig.safety.position_hold - rig.period_s, rig.row(loop.command).slew
    if loop.kind == JOINT or slew is None or held_s <= 0.0:
        return float("inf")
    return float(slew * rig.period_s / (rig.motor.speed_max * held_s))


def proposed(problem: Problem) -> Proposal:
    """The best gains within the bounds, or those of now with the reason why."""
    present = problem.loop.gains
    end, end_hz = problem.margins(present).gain_at_end, problem.plant.frequency_hz[-1]
    if end > QUIET:
        return Proposal(
            present,
            True,
            f"the response ends at {end_hz:.3g} Hz, where the loop gain is still {end:.2g};"
            " excite the loop itself, or further up",
            False,
        )
    is_sound = problem.holds(present)
    found, is_better = _searched(problem, is_sound)
    if found is None or not is_better:
        why = (
            "none better was found within the bounds"
            if is_sound
            else f"no gains that track as well keep Ms at {MS_LIMIT:g}"
        )
        return Proposal(present, True, why, holding=None if is_sound else found)
    if not is_sound:
        return Proposal(found, False, "the present gains break a bound")
    before, after = problem.merit(present), problem.merit(found)
    gained = 1.0 - min(
        after.tracking / before.tracking if before.tracking > 0.0 else 1.0, after.load / before.load
    )
    if gained < WORTH:
        return Proposal(
            present, True, f"the best found gains only {100.0 * max(gained, 0.0):.0f} %"
        )
    return Proposal(found, False, "better within the same bounds")


def _searched(problem: Problem, is_sound: bool) -> tuple[Gains | None, bool]:
    """The best gains by differential evolution over the logarithms of the feedback's gains, and
    whether they track as well as the present ones and, where those keep the bounds (``is_sound``),
    hold a load as well. Where none does, those that keep the bounds with the least loss of either;
    None where none keeps the bounds.
    """
    from scipy.optimize import differential_evolution  # type: ignore[import-untyped]

    present, before = problem.loop.gains, problem.merit(problem.loop.gains)
    names, bounds = _space(problem.loop)

    def feedback_at(logs: np.ndarray) -> Gains:
        values = {name: float(10.0**v) for name, v in zip(names, logs, strict=True)}
        return replace(present, **values)

    def cost(logs: np.ndarray) -> float:
        feedback = feedback_at(logs)
        excess = problem.excess(feedback, SPARE)  # no bound asks for the feedforward
        if excess > 0.0:
            return BIG * (1.0 + min(excess, BIG))
        gains = problem.with_feedforward(feedback)
        merit = problem.merit(gains)
        ratios = np.array([merit.tracking / before.tracking, merit.load / before.load])
        worst = float(np.max(ratios))
        # friction, creep and drift are loads while it tracks; a loop that breaks a bound may hold
        # a load better than any that keeps it
        if (worst if is_sound else ratios[0]) > 1.0:
            return BIG * (1.0 - 0.5 / (worst * _louder(gains, present)))
        return float(np.sum(np.log(np.maximum(ratios, 1e-6))))

    found = differential_evolution(
        cost, bounds, seed=1, popsize=12, maxiter=60, tol=1e-3, polish=False
    )
    gains = rounded(problem.with_feedforward(feedback_at(found.x)))
    if found.fun >= BIG or not problem.holds(gains):
        return None, False
    return gains, bool(found.fun < 0.1 * BIG)


def _louder(gains: Gains, present: Gains) -> float:
    """By how much kp or ki exceeds the present one, 1 at least. Gains that are to be safe at a cost
    do not lean on one of them: the response is least certain where it turns, near the crossover.
    """
    pairs = ((gains.kp, present.kp), (gains.ki, present.ki))
    return max(1.0, *(new / old for new, old in pairs if old > 0.0))


def _space(loop: Loop) -> tuple[list[str], list[tuple[float, float]]]:
    """Names of the gains that are searched and the bounds of their logarithms: a decade either way,
    about what the drive's kind takes where the present one is zero.
    """
    gains = loop.gains
    if loop.kind != JOINT:
        centre = np.log10(gains.kp or 10.0)
        return ["kp"], [(centre - 1.0, min(centre + 1.5, 3.0))]  # the file takes 1000 1/s at most
    names, bounds = [], []
    for name, usual in (("kp", 1.0), ("ki", 2.0), ("kd", 0.05)):
        centre = np.log10(getattr(gains, name) or usual)
        names.append(name)
        bounds.append((centre - 1.0, centre + 1.0))
    low, high = np.log10(CUTOFFS_HZ)
    return [*names, "derivative_cutoff_hz"], [*bounds, (float(low), float(high))]
