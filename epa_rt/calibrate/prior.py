"""How certain each reading of a rig is: the prior of its scale and zero for a diagnosis."""

from dataclasses import dataclass

from epa_rt.config.rig import Rig


@dataclass(frozen=True)
class ReadingPrior:
    """Standard deviations of what a reading keeps after its calibration.

    ``gain_ratio_std``: of the reading over the truth. ``offset_std``: of the reading where the
    truth is zero (gauge), in the signal's SI unit. ``correlation``: of gain and native offset.
    ``reading_std``: of one reading at rest, all included. ``range``: SI, outside it is
    extrapolated.
    """

    gain_ratio_std: float
    offset_std: float
    correlation: float
    reading_std: float
    range: tuple[float, float]


def reading_priors(rig: Rig) -> dict[str, ReadingPrior]:
    """By signal, of those that a calibration file covers; the others have no stated prior."""
    return {
        one.signal: ReadingPrior(
            one.gain_ratio_uncertainty,
            one.zero_uncertainty,
            one.correlation,
            one.reading_uncertainty,
            one.range,
        )
        for one in rig.applied_calibrations
    }
