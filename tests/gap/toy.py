"""A made-up rig for the tests of the attribution: a motor, a gas volume and a spring with friction,
three links.

Everything is a closed formula of measured inputs, so that a test knows what is in the data. Truths
come from other formulas than the catalogue's.
"""

import numpy as np
from numba import njit
from scipy.signal import lfilter

from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.subject import Link, Plain
from epa_rt.models.effect import Effect, Knob

RATE_HZ = 100.0
NOISE = {"drive": 0.01, "gas": 200.0, "spring": 0.1}
LINKS = (
    Link("drive", "drive", "current_a", "A", "command and speed to current"),
    Link("gas", "gas", "pressure_pa", "Pa", "valve to pressure"),
    Link("spring", "spring", "force_n", "N", "pressure, length and speed to force"),
)
_CHANNEL = {"drive": "current_a", "gas": "pressure_pa", "spring": "force_n"}


def _nominal(key: str, value: float, relative: float) -> Knob:
    return Knob(key, "", value, 0.2 * value, 5.0 * value, relative * value)


NOMINAL = (
    _nominal("drive.gain_a", 1.0, 0.02),
    _nominal("drive.viscous_a_s_m", 2.0, 0.3),
    _nominal("gas.flow_pa_s", 4e5, 0.05),
    _nominal("gas.loss_per_s", 0.8, 0.05),
    _nominal("spring.area_m2", 5e-4, 0.01),
    _nominal("spring.stiffness_n_m", 900.0, 0.02),
    _nominal("spring.viscous_n_s_m", 20.0, 0.1),
)
_ROWS = (  # effect, family, block, knobs (key, typical, low, high), further starts
    ("motor_friction", "motor friction", "drive", (("drive.coulomb_a", 0.1, 0.0, 1.0),), ()),
    (
        "cogging",
        "motor torque over its place",
        "drive",
        (("drive.cogging_a", 0.1, 0.0, 1.0), ("drive.cogging_per_m", 150.0, 50.0, 400.0)),
        ((0.1, 250.0),),
    ),
    ("bent_gain", "bent gain", "drive", (("drive.gain_cubic", 0.1, -1.0, 1.0),), ((-0.1,),)),
    (
        "current_offset",
        "current zero",
        "sensors",
        (("sensors.current_offset_a", 0.05, -1.0, 1.0),),
        ((-0.05,),),
    ),
    ("leak", "leak", "gas", (("gas.leak_ratio", 0.05, 0.0, 1.0),), ()),
    ("droop", "supply", "gas", (("gas.droop_ratio", 0.1, 0.0, 1.0),), ()),
    ("valve_delay", "valve timing", "gas", (("gas.delay_s", 0.02, 0.0, 0.1),), ()),
    (
        "pressure_offset",
        "pressure zero",
        "sensors",
        (("sensors.pressure_offset_pa", 3e3, -1e5, 1e5),),
        ((-3e3,),),
    ),
    ("coulomb", "friction", "spring", (("spring.coulomb_n", 2.0, 0.0, 20.0),), ()),
    (
        "dahl",
        "friction",
        "spring",
        (("spring.dahl_n", 2.0, 0.0, 20.0), ("spring.dahl_m", 2e-3, 2e-4, 2e-2)),
        (),
    ),
    ("hardening", "hardening", "spring", (("spring.cubic_n_m3", 5e5, -1e7, 1e7),), ((-5e5,),)),
    ("force_gain", "force scale", "sensors", (("sensors.force_gain", 1.02, 0.5, 1.5),), ((0.98,),)),
    (
        "force_offset",
        "force zero",
        "sensors",
        (("sensors.force_offset_n", 1.0, -50.0, 50.0),),
        ((-1.0,),),
    ),
    ("heat", "heat", "spring", (("spring.heat_ratio", 0.05, -0.5, 0.5),), ((-0.05,),)),
)
_NEUTRAL = {"sensors.force_gain": 1.0, "drive.cogging_per_m": 150.0, "spring.dahl_m": 2e-3}
CATALOGUE = tuple(
    Effect(
        name,
        family,
        block,
        tuple(k[0] for k in knobs),
        (tuple(k[1] for k in knobs), *more),
        name,
        "",
        "",
    )
    for name, family, block, knobs, more in _ROWS
)
_EFFECT_KNOBS = tuple(
    Knob(
        key,
        "",
        _NEUTRAL.get(key, 0.0),
        low,
        high,
        abs(typical - _NEUTRAL.get(key, 0.0)) or 0.5 * typical,
        name,
    )
    for name, _, _, knobs, _ in _ROWS
    for key, typical, low, high in knobs
)
KNOBS = {knob.key: knob for knob in (*NOMINAL, *_EFFECT_KNOBS)}
_EXTRA = {
    "sensors.pressure_offset_pa": ("gas", "spring"),
    "sensors.force_gain": ("spring",),
    "sensors.force_offset_n": ("spring",),
    "sensors.current_offset_a": ("drive",),
}


class Toy(Plain):
    """The Subject of the made-up rig."""

    name, rate_hz, links, nominal, knobs = "toy", RATE_HZ, LINKS, NOMINAL, KNOBS

    def __init__(self, without: tuple[str, ...] = ()) -> None:
        self.without_stop = False
        self.catalogue = tuple(e for e in CATALOGUE if e.name not in without)

    def touched(self, key: str) -> tuple[str, ...]:
        return _EXTRA.get(key) or (key.split(".")[0],)

    def prepare(self, recording: Recording) -> Recording:
        return recording

    def residual(self, prepared: Recording, values, link: str) -> np.ndarray:
        found = prepared.columns[_CHANNEL[link]] - predicted(prepared.columns, values, link)
        found[:50] = np.nan
        return found

    def features(self, prepared: Recording, link: str) -> dict[str, np.ndarray]:
        names = {
            "drive": ("command_v", "position_m", "speed_m_s"),
            "gas": ("valve_ratio", "pressure_pa"),
            "spring": ("pressure_pa", "position_m", "speed_m_s"),
        }
        return {name: prepared.columns[name] for name in names[link]}

    def free_run(self, recording, values, seed):
        return None

    def patched(self, values, effects) -> str:
        return "\n".join(f"{k}: {v}" for k, v in sorted(values.items()))


def predicted(c, values, link: str) -> np.ndarray:
    """Catalogue formulas: what a link's channel should read."""
    v = {key: values.get(key, knob.value) for key, knob in KNOBS.items()}
    x, speed = c["position_m"], c["speed_m_s"]
    if link == "drive":
        u = c["command_v"]
        return (
            v["drive.gain_a"] * u
            + v["drive.gain_cubic"] * u**3
            + v["drive.viscous_a_s_m"] * speed
            + v["drive.coulomb_a"] * np.tanh(speed / 0.01)
            + v["drive.cogging_a"] * np.sin(v["drive.cogging_per_m"] * x)
            + v["sensors.current_offset_a"]
        )
    pressure = c["pressure_pa"] - v["sensors.pressure_offset_pa"]
    if link == "gas":
        time = np.arange(len(x)) / RATE_HZ
        valve = np.interp(time - v["gas.delay_s"], time, c["valve_ratio"])
        flow = v["gas.flow_pa_s"] * valve * (1.0 - v["gas.droop_ratio"] * valve)
        return (
            _first_order(flow, v["gas.loss_per_s"] * (1.0 + v["gas.leak_ratio"]))
            + v["sensors.pressure_offset_pa"]
        )
    force = v["spring.area_m2"] * pressure * (1.0 + v["spring.heat_ratio"] * c["warm_ratio"])
    force = force + v["spring.stiffness_n_m"] * x + v["spring.viscous_n_s_m"] * speed
    force = (
        force
        + v["spring.cubic_n_m3"] * x**3
        + v["spring.coulomb_n"] * np.tanh(speed / 0.01)
        + v["spring.dahl_n"] * stop(x, v["spring.dahl_m"])
    )
    return v["sensors.force_gain"] * force + v["sensors.force_offset_n"]


def _first_order(flow: np.ndarray, loss_per_s: float) -> np.ndarray:
    keep = np.exp(-loss_per_s / RATE_HZ)
    return lfilter([(1.0 - keep) / loss_per_s], [1.0, -keep], flow)


@njit(nogil=True)
def stop(x: np.ndarray, half: float) -> np.ndarray:
    """Pre-sliding friction that saturates after ``half`` of travel, -1 to 1, smooth in ``half``."""
    state, found = 0.0, np.zeros(len(x))
    for k in range(1, len(x)):
        d = (x[k] - x[k - 1]) / half
        state = state * np.exp(-abs(d)) + np.sign(d) * (1.0 - np.exp(-abs(d)))
        found[k] = state
    return found


def recording(
    name: str,
    seed: int,
    values=None,
    seconds: float = 40.0,
    extra=None,
    still: bool = False,
    noise: float = 1.0,
) -> Recording:
    """A log of the toy with ``values``; ``extra(columns) -> {link: what to add}`` is a law of its
    own.
    """
    rng = np.random.default_rng(seed)
    n = round(seconds * RATE_HZ)
    t = np.arange(n) / RATE_HZ
    drift = rng.uniform(0.8, 1.2)
    x = (
        np.zeros(n)
        if still
        else 0.02 * np.sin(2 * np.pi * 0.31 * drift * t)
        + 0.01 * np.sin(2 * np.pi * 0.83 * drift * t + 1.0)
    )
    columns = {
        "position_m": x,
        "speed_m_s": np.gradient(x) * RATE_HZ,
        "command_v": 0.8 * np.sin(2 * np.pi * 0.47 * drift * t) + 0.1,
        "valve_ratio": (
            (np.sin(2 * np.pi * 0.11 * drift * t) > 0)
            * (0.5 + 0.5 * (np.sin(2 * np.pi * 0.05 * t) > 0))
        ),
        "warm_ratio": 1.0 - np.exp(-t / 15.0),
    }
    columns["pressure_pa"] = np.zeros(n)
    gas = predicted(columns, values or {}, "gas")
    columns["pressure_pa"] = gas + ((extra(columns).get("gas", 0.0)) if extra else 0.0)
    found = {"pressure_pa": columns["pressure_pa"]} | {
        _CHANNEL[link]: predicted(columns, values or {}, link) for link in ("drive", "spring")
    }
    for link, more in (extra(columns) if extra else {}).items():
        if link != "gas":
            found[_CHANNEL[link]] = found[_CHANNEL[link]] + more
    columns |= {
        channel: found[channel] + noise * NOISE[link] * rng.standard_normal(n)
        for link, channel in _CHANNEL.items()
    }
    half = n // 4
    spans = tuple(Span(f"trial {i}", i * half, (i + 1) * half, True) for i in range(4))
    return Recording(name, "", "toy", "", "", 1.0 / RATE_HZ, np.arange(n), columns, spans)


class White:
    """A floor of white noise."""

    source, ar, scatter = "twin", np.zeros(0), 1.0

    def __init__(self, link: str, rms: float) -> None:
        self.link, self.rms, self.innovation, self.bias = link, rms, rms, {}

    def whiten(self, x: np.ndarray) -> np.ndarray:
        return x / self.rms


def floors(subject, recordings, values, seed=0):
    """The toy's true floors; the measured pressure's noise goes into the spring's force as well."""
    rms = NOISE | {"spring": float(np.hypot(NOISE["spring"], 5e-4 * NOISE["gas"]))}
    return {link: White(link, size) for link, size in rms.items()}
