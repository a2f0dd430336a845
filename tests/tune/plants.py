"""Plants with known responses and the loops around them, simulated sample by sample."""

import numpy as np

from epa_rt.tune.response import Excited

DT_S = 1e-3


def resonant(frequency_hz: np.ndarray, gain=8.0, hertz=2.0, damping=0.2, delay=3) -> np.ndarray:
    """The response of ``Resonant`` at frequencies in Hz, sampled and held at DT_S."""
    a, b, c = _matrices(gain, hertz, damping)
    z = np.exp(2j * np.pi * frequency_hz * DT_S)
    one = np.eye(2)
    response = np.array([c @ np.linalg.solve(w * one - a, b) for w in z])
    return response * z ** -float(delay)


def _matrices(gain, hertz, damping):
    omega = 2.0 * np.pi * hertz
    pole = omega * (-damping + 1j * np.sqrt(1.0 - damping**2))
    factor = np.exp(pole * DT_S)
    a = np.array([[factor.real, factor.imag], [-factor.imag, factor.real]])
    # x' = pole x + u in the complex plane; the output takes its imaginary part
    held = (factor - 1.0) / pole
    b = np.array([held.real, -held.imag])
    c = np.array([0.0, -gain * omega**2 / pole.imag])
    return a, b, c


def closed_loop(
    reference: np.ndarray, noise: np.ndarray, kp=0.03, ki=0.3, forward=0.12, delay=3
) -> Excited:
    """A resonant plant under PI control with feedforward; ``noise`` is added to its output."""
    a, b, c = _matrices(8.0, 2.0, 0.2)
    state, integral = np.zeros(2), 0.0
    queue = [0.0] * delay
    command, output = np.empty(len(reference)), np.empty(len(reference))
    for k in range(len(reference)):
        output[k] = c @ state + noise[k]
        error = reference[k] - output[k]
        integral += ki * error * DT_S
        command[k] = kp * error + integral + forward * reference[k]
        queue.append(command[k])
        state = a @ state + b * queue.pop(0)
    return Excited(reference, command, output)
