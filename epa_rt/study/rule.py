"""The control rule: which pressure for which frequency, as a file, and as an experiment that epa
run takes.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from epa_rt.study.serial import Maps
from epa_rt.study.setting import load_setting

GOALS = {"stroke": "stroke_m", "power": "peak_power_w", "energy": "energy_a2_s"}
KEYS = ("goal", "mean", "amplitude", "frequency", "pressure")


@dataclass(frozen=True)
class Rule:
    """Best pressure (Pa, absolute, at no-load length) over frequency (rad/s), both (N,),
    frequencies rising.
    """

    goal: str
    mean_m: float
    amplitude_m: float
    frequency_rad_s: np.ndarray
    pressure_pa: np.ndarray

    def at(self, frequency_rad_s: float) -> float:
        """Pressure (Pa) between the rule's points on a straight line. Raises ValueError outside its
        range.
        """
        if not self.frequency_rad_s[0] <= frequency_rad_s <= self.frequency_rad_s[-1]:
            raise ValueError(
                f"found {frequency_rad_s:g} rad/s, expected {self.frequency_rad_s[0]:g} to"
                f" {self.frequency_rad_s[-1]:g} rad/s, where the rule holds"
            )
        return float(np.interp(frequency_rad_s, self.frequency_rad_s, self.pressure_pa))


def rule_of(maps: Maps, goal: str) -> Rule:
    """The rule that a map gives, over the frequencies at which some pressure follows the sine."""
    pressures = maps.best_pressure_pa(GOALS[goal])
    order = np.argsort(maps.asked.frequency_rad_s)
    order = order[np.isfinite(pressures[order])]
    return Rule(
        goal,
        maps.asked.mean_m,
        maps.asked.amplitude_m,
        maps.asked.frequency_rad_s[order],
        pressures[order],
    )


def rule_text(rule: Rule, plant: str) -> str:
    """The rule as a file that load_rule reads."""
    head = (
        f"# Which pressure (absolute, at no-load length) for which frequency: the least {rule.goal}"
        f" of the motor found by 'epa study serial'\n# for the plant {plant}. 'epa study rule'"
        " makes an experiment of it.\n"
    )
    return head + yaml.safe_dump(
        {
            "study": "rule",
            "goal": rule.goal,
            "mean": f"{rule.mean_m * 1e3:g} mm",
            "amplitude": f"{rule.amplitude_m * 1e3:g} mm",
            "frequency": [f"{w:g} rad/s" for w in rule.frequency_rad_s],
            "pressure": [f"{p / 1e3:g} kPa abs" for p in rule.pressure_pa],
        },
        sort_keys=False,
    )


def load_rule(path: Path) -> Rule:
    """Raises ConfigError."""
    said = load_setting(path, "rule", KEYS)
    frequencies = said.frequencies("frequency")
    listed = said.source.data.get("pressure")
    if not isinstance(listed, list) or len(listed) != len(frequencies):
        raise said.source.error(
            ("pressure",),
            f"{len(listed) if isinstance(listed, list) else listed} pressures",
            f"a list of {len(frequencies)}, one per frequency",
        )
    pressures = np.array([said.pressure(("pressure", i), one) for i, one in enumerate(listed)])
    if not np.all((pressures > 1e3) & (pressures < 2e6)):
        raise said.source.error(
            ("pressure",), str(listed), "absolute pressures from 1 kPa to 2 MPa ('... kPa abs')"
        )
    if np.any(np.diff(frequencies) <= 0.0):
        raise said.source.error(
            ("frequency",), str(said.source.data["frequency"]), "rising frequencies"
        )
    goal = said.source.data.get("goal")
    if goal not in GOALS:
        raise said.source.error(("goal",), repr(goal), "one of " + ", ".join(GOALS))
    return Rule(
        goal,
        said.quantity("mean", "m", -1.0, 1.0),
        said.quantity("amplitude", "m", 1e-4, 0.1),
        frequencies,
        pressures,
    )


def experiment_text(rule: Rule, frequency_rad_s: float, seconds: float) -> str:
    """An experiment for a rig like config/rigs/mass.yaml: fill at no-load length to the rule's
    pressure, shut in, follow the sine.

    Raises ValueError outside the rule's range.
    """
    pressure_pa = rule.at(frequency_rad_s)
    fill = {
        "loop": "motor_position",
        "valves": {"muscle": {"set": f"{pressure_pa / 1e3:.6g} kPa abs"}},
        "until": "valves_settled",
        "timeout": "60 s",
    }
    sine = {
        "mean": f"{rule.mean_m * 1e3:g} mm",
        "peak_to_peak": f"{2e3 * rule.amplitude_m:g} mm",
        "frequency": f"{frequency_rad_s / (2.0 * np.pi):.8g} Hz",
        "fade": f"{min(3.0, 0.2 * seconds):g} s",
    }
    phases = [
        {
            "name": "go_to_no_load",
            "loop": "motor_position",
            "move": {"to": "no_load", "speed": "20 mm/s"},
        },
        {"name": "fill", **fill},
        {
            "name": "settle",
            "loop": "motor_position",
            "for": "3 s",
            "valves": {"muscle": "hold_and_trim"},
        },
        {"name": "trim", **fill},
        {
            "name": "go_to_mean",
            "move": {"to": f"{rule.mean_m * 1e3:g} mm", "speed": "10 mm/s"},
            "valves": {"muscle": "hold"},
        },
        {"name": "rest_at_mean", "for": "2 s"},
        {
            "name": "trial",
            "trial": True,
            "sine": sine,
            "for": f"{seconds:g} s",
            "valves": {"muscle": "hold"},
        },
        {"name": "rest", "for": "1 s"},
        {"name": "return", "loop": "motor_position", "move": {"to": "no_load", "speed": "20 mm/s"}},
        {
            "name": "vent",
            "loop": "motor_position",
            "valves": {"muscle": "vent"},
            "until": "valves_settled",
            "timeout": "60 s",
        },
    ]
    return "# Made by 'epa study rule'.\n" + yaml.safe_dump(
        {
            "experiment": "mass_at_best_pressure",
            "loop": "joint_angle",
            "phases": phases,
            "description": (
                f"Mass on a sine of {frequency_rad_s:.4g} rad/s at the pressure of least"
                f" {rule.goal}"
            ),
        },
        sort_keys=False,
    )
