"""A rational model of a measured response, to simulate what the loop does in time.

Vector fitting with stable poles (Gustavsen and Semlyen, IEEE Trans. Power Delivery 14, 1999): poles
are moved until the response over partial fractions needs no more. A delay appears as zeros on the
right. Of all orders the one with the least Bayesian information criterion.
"""

from dataclasses import dataclass

import numpy as np

ORDERS = (2, 3, 4, 5, 6)
ROUNDS = 20  # of moving poles; they stand still after about ten
LEAST_RELATIVE = 0.01  # no response is believed to better than this: plants are not linear


@dataclass(frozen=True)
class Model:
    """Continuous model: poles and residues (n,) of the response, in rad/s, behind ``integrators``
    (0 or 1). ``misfit``: root mean square of the relative error over frequency.
    """

    poles: np.ndarray
    residues: np.ndarray
    integrators: int
    misfit: float

    def at(self, frequency_hz: np.ndarray) -> np.ndarray:
        """The response (m,) at frequencies in Hz."""
        s = 2j * np.pi * frequency_hz
        response: np.ndarray = (self.residues / (s[:, None] - self.poles)).sum(axis=1)
        return response / s**self.integrators

    def sampled(self, dt_s: float) -> tuple[np.ndarray, np.ndarray]:
        """Factors (n,) of each state and of the held command over one cycle: x = a x + b u, the
        output (or its rate, before an integrator) the real part of the sum of x.
        """
        a = np.exp(self.poles * dt_s)
        return a, self.residues * (a - 1.0) / self.poles


def fitted(
    frequency_hz: np.ndarray, response: np.ndarray, deviation: np.ndarray, integrators: int
) -> Model:
    """The model of a response (m,) known to a standard deviation (m,)."""
    s = 2j * np.pi * frequency_hz
    plain = response * s**integrators
    relative = np.maximum(deviation / np.abs(response), LEAST_RELATIVE)
    weight = 1.0 / (relative * np.abs(plain))
    best: tuple[float, np.ndarray, np.ndarray] | None = None
    for order in ORDERS:
        if 2 * order >= len(s):
            break
        poles = _poles(s, plain, weight, order)
        residues = _residues(s, plain, weight, poles)
        error = weight * ((residues / (s[:, None] - poles)).sum(axis=1) - plain)
        points = 2 * len(s)
        score = points * np.log(np.mean(np.abs(error) ** 2)) + 2 * order * np.log(points)
        if best is None or score < best[0]:
            best = (float(score), poles, residues)
    assert best is not None
    model = Model(best[1], best[2], integrators, 0.0)
    misfit = float(np.sqrt(np.mean(np.abs(model.at(frequency_hz) / response - 1.0) ** 2)))
    return Model(best[1], best[2], integrators, misfit)


def _poles(s: np.ndarray, plain: np.ndarray, weight: np.ndarray, order: int) -> np.ndarray:
    """Stable poles (order,), complex ones in pairs one after the other."""
    low, high = abs(s[0]), abs(s[-1])
    pairs = np.geomspace(2.0 * low, 0.8 * high, max(order // 2, 1))
    poles = np.array([v for w in pairs for v in (-0.05 * w + 1j * w, -0.05 * w - 1j * w)])
    if order % 2:
        poles = np.concatenate([poles, [-np.sqrt(low * high) + 0j]])
    for _ in range(ROUNDS):
        basis = _basis(s, poles)
        columns: np.ndarray = np.hstack([basis, -basis * plain[:, None]]) * weight[:, None]
        solved = _real_solution(columns, plain * weight)
        moved = _zeros_of(poles, solved[len(poles) :])
        moved = np.where(moved.real > 0.0, -moved.conj(), moved)
        moved = np.where(moved.real > -0.01 * low, -0.01 * low + 1j * moved.imag, moved)
        poles = _paired(_wide(moved, s.imag))
    return poles


def _wide(poles: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Poles (n,) with at least half the distance of the points (m,) in rad/s about them as their
    half-width: a narrower resonance would lie between two points, of which neither shows it.
    """
    at = np.clip(np.searchsorted(omega, np.abs(poles.imag)), 1, len(omega) - 1)
    least = 0.5 * (omega[at] - omega[at - 1])
    is_narrow = (np.abs(poles.imag) > 0.0) & (-poles.real < least)
    wide: np.ndarray = np.where(is_narrow, -least + 1j * poles.imag, poles)
    return wide


def _residues(
    s: np.ndarray, plain: np.ndarray, weight: np.ndarray, poles: np.ndarray
) -> np.ndarray:
    """Complex residues (n,) of the best partial fractions over given poles."""
    solved = _real_solution(_basis(s, poles) * weight[:, None], plain * weight)
    residues = np.zeros(len(poles), complex)
    i = 0
    while i < len(poles):
        if poles[i].imag:
            residues[i], residues[i + 1] = (
                solved[i] + 1j * solved[i + 1],
                solved[i] - 1j * solved[i + 1],
            )
            i += 2
        else:
            residues[i] = solved[i]
            i += 1
    return residues


def _basis(s: np.ndarray, poles: np.ndarray) -> np.ndarray:
    """Partial fractions (m, n) with real coefficients: of a pair their sum and their difference."""
    columns: np.ndarray = 1.0 / (s[:, None] - poles)
    i = 0
    while i < len(poles):
        if poles[i].imag:
            one, other = columns[:, i].copy(), columns[:, i + 1].copy()
            columns[:, i], columns[:, i + 1] = one + other, 1j * (one - other)
            i += 2
        else:
            i += 1
    return columns


def _real_solution(columns: np.ndarray, target: np.ndarray) -> np.ndarray:
    stacked = np.vstack([columns.real, columns.imag])
    scale = np.linalg.norm(stacked, axis=0)
    scale[scale == 0.0] = 1.0
    both = np.concatenate([target.real, target.imag])
    result: np.ndarray = np.linalg.lstsq(stacked / scale, both, None)[0] / scale
    return result


def _zeros_of(poles: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Zeros of 1 + sum weights / (s - poles): eigenvalues of A - b c."""
    n = len(poles)
    a, b = np.zeros((n, n)), np.zeros(n)
    i = 0
    while i < n:
        if poles[i].imag:
            real, imag = poles[i].real, poles[i].imag
            a[i : i + 2, i : i + 2] = [[real, imag], [-imag, real]]
            b[i] = 2.0
            i += 2
        else:
            a[i, i], b[i] = poles[i].real, 1.0
            i += 1
    zeros: np.ndarray = np.linalg.eigvals(a - np.outer(b, weights))
    return zeros


def _paired(poles: np.ndarray) -> np.ndarray:
    """Pairs one after the other, the one with the positive imaginary part first; real ones last."""
    upper = poles[poles.imag > 1e-9 * np.abs(poles)]
    real = poles[np.abs(poles.imag) <= 1e-9 * np.abs(poles)].real.astype(complex)
    both = np.array([v for p in upper for v in (p, p.conjugate())], complex)
    paired: np.ndarray = np.concatenate([both, real])
    return paired
