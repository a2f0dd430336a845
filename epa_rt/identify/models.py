"""The paper's force models in normalised quantities: static (eqs. 1-3), Tang and Liu (eqs. 4-7),
the polynomial (eq. 8).
"""

import numpy as np

from epa_rt.identify.linear import Model, Scaled

SIGN_RAMP = 0.02  # of the normal speed: inside it sign(x') of eq. 7 is a ramp


def _none(part: Scaled) -> np.ndarray:
    return np.zeros((len(part.f), 0))


def _geometric(part: Scaled) -> np.ndarray:
    return part.geometric


def _boyle(part: Scaled) -> np.ndarray:
    return part.boyle


def _static_fitted(part: Scaled) -> np.ndarray:
    """Eq. 1 with b and n free: it is a sum of P and P L^2 with L the whole length, and so is that
    of any other b and n.
    """
    return np.column_stack([part.geometric, part.p])


def _static_quadratic(part: Scaled) -> np.ndarray:
    return np.column_stack([part.p, part.p * part.l, part.p * part.l**2])


def _friction(part: Scaled) -> list[np.ndarray]:
    """Eqs. 6 and 7, x = -l the contraction: damping by P v^2 and P v, Coulomb by P x^k sign v and
    x^k sign v.
    """
    sign = np.clip(part.v / SIGN_RAMP, -1.0, 1.0)
    x = -part.l
    return [
        -part.p * part.v**2,
        -part.p * part.v,
        *(-part.p * x**k * sign for k in range(3)),
        *(x**k * sign for k in range(3)),
    ]


def _tang_friction(part: Scaled) -> np.ndarray:
    return np.column_stack(_friction(part))


def _tang_all(part: Scaled) -> np.ndarray:
    x = -part.l
    return np.column_stack(
        [*(part.p * x**k for k in range(3)), *(x**k for k in range(3)), *_friction(part)]
    )


def _mix(linear: int):
    """Terms from coefficients for a given phi: the last three terms of eq. 7 are phi times those
    before.
    """

    def mix(phi: float) -> np.ndarray:
        matrix = np.zeros((linear + 6, linear + 3))
        matrix[:linear, :linear] = np.eye(linear)
        matrix[linear : linear + 3, linear:] = np.eye(3)
        matrix[linear + 3 :, linear:] = phi * np.eye(3)
        return matrix

    return mix


def _polynomial(part: Scaled) -> np.ndarray:
    return np.column_stack(
        [part.l * part.p, part.v * part.p, part.v**2, part.v * part.p**2, np.ones(len(part.f))]
    )


_DA, _CO = (
    ("D2 P v^2", "D1 P v"),
    tuple(f"N{k} P x^{k} sign v" for k in range(3))
    + tuple(f"N{k} phi x^{k} sign v" for k in range(3)),
)
_ST = tuple(f"K{k} P x^{k}" for k in range(3)) + tuple(f"S{k} x^{k}" for k in range(3))

MODELS: tuple[Model, ...] = (
    Model(
        "static, geometry",
        "eq. 1 with the plant file's b and n at the measured pressure; nothing fitted",
        (),
        _none,
        _geometric,
    ),
    Model(
        "static, Boyle",
        "eqs. 1-3: the same, the pressure computed from P0 and length; nothing fitted",
        (),
        _none,
        _boyle,
    ),
    Model(
        "static, b and n fitted",
        "eq. 1 with b and n fitted: geometry times c0, plus c1 P",
        ("c0 eq. 1", "c1 P"),
        _static_fitted,
    ),
    Model(
        "static, quadratic",
        "P (c0 + c1 L + c2 L^2): eq. 1 with b, n and an offset of length",
        ("c0 P", "c1 P L", "c2 P L^2"),
        _static_quadratic,
    ),
    Model(
        "Tang, geometric",
        "eq. 4 with the static force of eq. 1 and fitted friction (eqs. 6, 7)",
        _DA + _CO,
        _tang_friction,
        _geometric,
        _mix(2),
        "phi",
        (-2.0, 2.0),
    ),
    Model(
        "Tang, all fitted",
        "eqs. 4-7 with all coefficients fitted",
        _ST + _DA + _CO,
        _tang_all,
        None,
        _mix(8),
        "phi",
        (-2.0, 2.0),
    ),
    Model("polynomial", "eq. 8", ("C1 L P", "C2 v P", "C3 v^2", "C4 v P^2", "C5"), _polynomial),
)
BY_NAME = {model.name: model for model in MODELS}
GEOMETRY = "static, geometry"
TANG_GEOMETRIC, TANG_ALL, POLYNOMIAL = "Tang, geometric", "Tang, all fitted", "polynomial"


def fitted_geometry(
    c0: float, c1: float, braid_length_m: float, turns: float, pressure_pa: float, force_n: float
) -> tuple[float, float]:
    """Thread length b (m) and turns n that "static, b and n fitted" amounts to; NaN where no muscle
    has them. Source: eq. 1.
    """
    squared = (
        braid_length_m**2 - c1 / c0 * 4.0 * np.pi * turns**2 * force_n / pressure_pa
        if c0 > 0.0
        else -1.0
    )
    return (
        (float(np.sqrt(squared)), float(turns / np.sqrt(c0)))
        if squared > 0.0
        else (float("nan"), float("nan"))
    )
