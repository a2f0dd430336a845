"""The whole identification: every model fitted to the same trials and judged, terms chosen, the gas
beside it.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.recording import Recording
from epa_rt.identify import models
from epa_rt.identify.answer import Answer, trial_facts
from epa_rt.identify.data import (
    IdentifyError,
    Normalisation,
    Trial,
    normalisation,
    pressures,
    remarks,
    trials,
)
from epa_rt.identify.gas import fit_gas
from epa_rt.identify.linear import Scaled, predicted, scaled, sums
from epa_rt.identify.physical import MODELS as PHYSICAL
from epa_rt.identify.physical import PhysicalFit, fit_physical
from epa_rt.identify.scores import Score, score
from epa_rt.identify.selection import all_terms, effective_samples, select_terms
from epa_rt.models.blocks.muscle import NO_LOAD

HOLDOUTS = ("both", "trial", "pressure", "none")
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Asked:
    """``holdout``: one of HOLDOUTS. ``physical``, ``terms``: whether these are done at all."""

    holdout: str = "both"
    physical: bool = True
    terms: bool = True


def identify(
    recordings: Sequence[Recording],
    rig: Rig,
    params: np.ndarray,
    asked: Asked = Asked(),
    progress: Progress = lambda stage, share: None,
) -> tuple[Answer, list[Trial], list[Scaled]]:
    """Fits everything to the trials of all recordings; ``params``: (1,) PARAMS of the plant as it
    is believed.

    Also returns the trials and the same normalised. Raises IdentifyError.
    """
    begun = time.perf_counter()
    found = trials(recordings, rig, params)
    answer, data = identify_trials(found, params, asked, progress)
    return replace(answer, seconds=time.perf_counter() - begun), found, data


def identify_trials(
    found: list[Trial],
    params: np.ndarray,
    asked: Asked = Asked(),
    progress: Progress = lambda stage, share: None,
) -> tuple[Answer, list[Scaled]]:
    """As identify, from trials. Raises IdentifyError."""
    norm, groups = normalisation(params), pressures(found)
    _checked(found, norm, groups, asked)
    b, turns = (
        float(params["muscle"]["braid_length_m"][0, 0]),
        float(params["muscle"]["braid_turns_ratio"][0, 0]),
    )
    data = [scaled(trial, norm, b, turns) for trial in found]
    linear = []
    for i, model in enumerate(models.MODELS):
        progress(f"fit: {model.name}", 0.3 * i / len(models.MODELS))
        linear.append(
            (
                model,
                *score(model, sums(model, data, found[0].period_s), groups, norm, asked.holdout),
            )
        )
    by_name = {model.name: (model, fitted, judged) for model, fitted, judged in linear}
    physical = []
    for i, model in enumerate(PHYSICAL if asked.physical else ()):
        share = 0.3 + 0.5 * i / len(PHYSICAL)
        progress(f"fit: {model.name}", share)
        physical.append(
            fit_physical(
                model,
                params,
                found,
                groups,
                asked.holdout,
                lambda stage, part, share=share: progress(f"fit: {stage}", share + 0.16 * part),
            )
        )
    progress("fit: gas", 0.8)
    gas = fit_gas(found, b, turns, float(params["gas"]["dead_volume_m3"][0, 0]))
    model, fitted, judged = by_name[models.POLYNOMIAL]
    independent = effective_samples([part.f - predicted(model, fitted, part) for part in data])
    selected = []
    if asked.terms:
        progress("terms: all 64", 0.82)
        all_sums = sums(all_terms(), data, found[0].period_s)
        selected = select_terms(
            all_sums, independent, lambda stage, part: progress(stage, 0.9 + 0.1 * part)
        )
    geometry = models.fitted_geometry(
        *by_name["static, b and n fitted"][2].coefficients.values(),
        b,
        turns,
        norm.pressure_pa,
        norm.force_n,
    )
    said = (*remarks(found), *_weak(judged, physical, found, norm))
    return (
        Answer(
            tuple(map(trial_facts, found)),
            norm,
            tuple(linear),
            geometry,
            tuple(physical),
            gas,
            tuple(selected),
            independent,
            said,
        ),
        data,
    )


def _checked(found: Sequence[Trial], norm: Normalisation, groups: np.ndarray, asked: Asked) -> None:
    if max(float(t.length_m.max()) for t in found) < norm.no_load_m + 1e-3:
        raise IdentifyError(
            f"found lengths up to {max(t.length_m.max() for t in found) * 1e3:.1f} mm, expected"
            f" some beyond the no-load length of {norm.no_load_m * 1e3:.1f} mm that the plant file"
            " gives the muscle"
        )
    braid_m = norm.no_load_m / NO_LOAD
    if max(float(t.length_m.max()) for t in found) >= braid_m:
        raise IdentifyError(
            f"found lengths up to {max(t.length_m.max() for t in found) * 1e3:.1f} mm, expected all"
            f" shorter than the braid, which is {braid_m * 1e3:.1f} mm in the plant file"
            " (braid_length; rest0 is the length at travel 0)"
        )
    if asked.holdout == "pressure" and groups.max() == 0:
        raise IdentifyError(
            f"found one no-load pressure ({found[0].p0_pa / 1e3:.0f} kPa), expected several to"
            " leave one out"
        )
    if asked.holdout == "trial" and len(found) == 1:
        raise IdentifyError("found one trial, expected several to leave one out")
    if len({round(t.period_s * 1e9) for t in found}) > 1:
        raise IdentifyError("found trials of different sampling periods, expected one")


def _weak(
    polynomial: Score, physical: Sequence[PhysicalFit], found: Sequence[Trial], norm: Normalisation
) -> list[str]:
    """What is wrong with the fits themselves."""
    said = [
        f"{fit.model.name}: {', '.join(fit.at_bound)} at an end of what the plant allows; its"
        " interval means nothing"
        for fit in physical
        if fit.at_bound
    ]
    said += [
        f"{fit.model.name}: {', '.join(fit.unseen)} changes nothing in these trials and is not"
        " identified"
        for fit in physical
        if fit.unseen
    ]
    _, c2, c3, c4, _ = polynomial.coefficients.values()
    pressure = (
        np.linspace(min(t.gauge_pa.min() for t in found), max(t.gauge_pa.max() for t in found), 50)
        / norm.pressure_pa
    )
    fastest = max(float(np.abs(t.speed_m_s).max()) for t in found) / norm.speed_m_s
    slope = c2 * pressure + c4 * pressure**2 + 2.0 * abs(c3) * fastest
    if slope.max() > 0.0:
        said.append(
            f"polynomial: at {pressure[int(np.argmax(slope))] * norm.pressure_pa / 1e3:.0f} kPa and"
            " the fastest trial's speed its force rises with the speed of contraction; there it"
            " drives a mass instead of damping it"
        )
    return said
