"""One row per claim of the paper: what it says, what we found, whether it holds, and why."""

from dataclasses import asdict, dataclass, replace

import numpy as np

from epa_rt.study.motion import PID
from epa_rt.study.serial import Maps

# the plant that the reasons given here were found on; another plant's figures stand without them
EXPLAINED = "serial"


@dataclass(frozen=True)
class Claim:
    """``holds``: True, False, or None where the paper's own words leave it open."""

    where: str
    claim: str
    ours: str
    holds: bool | None
    why: str

    def as_dict(self) -> dict:
        return asdict(self)

    @property
    def verdict(self) -> str:
        return {True: "holds", False: "does not hold", None: "open"}[self.holds]


def serial_claims(maps: Maps, beside: dict[str, Maps]) -> list[Claim]:
    """Claims of 3.2, judged on a map that has the frequencies and pressures they speak of (others
    are left out).
    """
    asked = maps.asked
    kpa, omega = asked.pressure_pa / 1e3, asked.frequency_rad_s
    if not (maps.best("stroke_m") >= 0).any():
        return [
            Claim(
                "3.2",
                "The PID makes the mass follow the sine",
                "at no pressure and frequency of this study",
                False,
                "",
            ),
            *(_beside(name, one) for name, one in beside.items() if _is_eq_8(name, maps)),
        ]
    ratio = maps.at_best("stroke_m") / (2.0 * asked.amplitude_m)
    found: list[Claim] = []
    at80 = np.flatnonzero(np.isclose(omega, 80.0))
    if at80.size:
        found += _at_80(maps, int(at80[0]), kpa)
    if omega.min() <= 95.0 and omega.max() >= 110.0:
        fast = (omega >= 95.0) & (omega <= 110.0)
        most, least = ratio[fast].max(), ratio[fast].min()
        found.append(
            Claim(
                "3.2, Fig. 7",
                "95 to 110 rad/s take 15 % of the mass motion",
                f"{100 * least:.1f} to {100 * most:.1f} % at each frequency's best pressure",
                bool(most <= 0.15),
                "What remains is braid friction (1.2 % of the force at 15 cm), damping and the"
                " PID's lag; a linear spring without loss would reach 0.",
            )
        )
        good = 100.0 * np.nanmean(
            maps.of["stroke_m"][:, np.argmin(np.abs(kpa - 800.0))] <= 1.1 * maps.at_best("stroke_m")
        )
        found.append(
            Claim(
                "3.2, Fig. 7",
                "800 kPa is best, or nearly, at most frequencies",
                f"within 10 % of the least stroke at {good:.0f} % of the frequencies",
                bool(good > 50.0),
                "The best pressure follows the frequency (k rises with P); one pressure near the"
                " middle is good only near its own resonance, and at low frequencies any is nearly"
                " as good.",
            )
        )
    if omega.min() <= 60.0 and omega.max() >= 100.0:
        between = (omega >= 60.0) & (omega <= 100.0)
        valley = maps.best_pressure_pa("peak_power_w")[between] / 1e3
        found.append(
            Claim(
                "3.2, Fig. 8",
                "The valley of peak power rises monotonically from 60 to 100 rad/s",
                f"{valley[0]:.0f} kPa at 60 to {valley[-1]:.0f} kPa at 100 rad/s, steps"
                f" {', '.join(f'{s:.0f}' for s in np.diff(valley))}",
                bool(np.all(np.diff(valley) >= 0.0) and valley[-1] > valley[0]),
                "Peak power is the spool's |F v|; it is least near resonance, just above the"
                " pressure at which the braid no longer reaches its lock.",
            )
        )
        apart = maps.best_pressure_pa("peak_power_w") - maps.best_pressure_pa("stroke_m")
        found.append(
            Claim(
                "3.2, Fig. 8",
                "The best pressure for power is not the one for displacement",
                f"differs at {int(np.sum(apart != 0))} of {len(omega)} frequencies, by at most"
                f" {np.abs(apart).max() / 1e3:.0f} kPa",
                bool(np.mean(apart != 0) > 0.5),
                "Judged by more than half of the frequencies. With a physical muscle both lie at"
                " the low edge of the same valley and are nearly one rule.",
            )
        )
    if asked.plant.name != EXPLAINED:
        found = [replace(claim, why="") for claim in found]
    return found + [_beside(name, one) for name, one in beside.items() if _is_eq_8(name, maps)]


def _is_eq_8(name: str, maps: Maps) -> bool:
    """A plant beside the study's own whose muscle is another law is shown, and is no word on eq.
    (8).
    """
    return any(
        plant.name == name and plant.params["muscle"]["law_code"][0, 0] == 2.0
        for plant in maps.asked.beside
    )


def _at_80(maps: Maps, row: int, kpa: np.ndarray) -> list[Claim]:
    stroke = maps.of["stroke_m"][row] * 100.0
    best = maps.best_pressure_pa("stroke_m")[row] / 1e3
    shown = {
        p: stroke[np.argmin(np.abs(kpa - p))]
        for p in (500, 600, 800, 1000)
        if np.abs(kpa - p).min() < 1.0
    }
    found = [
        Claim(
            "3.2, Fig. 6",
            "At 80 rad/s the stroke is least near 800 kPa",
            (
                f"{best:.0f} kPa ({_grid(kpa)})"
                if np.isfinite(best)
                else "no pressure follows the sine"
            ),
            bool(abs(best - 800.0) <= 50.0),
            "The muscle's thickness was chosen for this one figure (16 mm); all others follow.",
        )
    ]
    if len(shown) == 4:
        falls = shown[500] > shown[600] > shown[800] < shown[1000]
        found.append(
            Claim(
                "3.2, Figs 5, 6",
                "The stroke falls from 500 to 600 to 800 kPa and rises beyond",
                ", ".join(f"{v:.2f} cm at {p} kPa" for p, v in shown.items()),
                bool(falls),
                "Below about 800 kPa the mass pulls the braid into its lock (15 cm) every period,"
                " and the motor has to take the way; beyond, the muscle is stiffer than resonance"
                " wants.",
            )
        )
    motion, wanted = maps.of["motion_m"][row], 2.0 * maps.asked.amplitude_m
    if maps.asked.drive.pid == PID and np.isfinite(motion).all():
        missing = 100.0 * (1.0 - motion / wanted)
        found.append(
            Claim(
                "3.2, Fig. 5",
                "The PID (10, 50, 0.12) follows the sine with high precision at any pressure",
                f"{100 * motion.min():.2f} to {100 * motion.max():.2f} cm of {100 * wanted:g} cm at"
                " 80 rad/s",
                bool(np.abs(missing).max() <= 10.0),
                f"Judged by 10 %. {missing.min():.0f} to {missing.max():.0f} % of the motion are"
                f" missing, most at {kpa[motion.argmin()]:.0f} kPa.",
            )
        )
    return found


def _grid(kpa: np.ndarray) -> str:
    return (
        f"grid of {np.diff(np.sort(kpa)).min():.0f} kPa" if len(kpa) > 1 else "the only one tried"
    )


def _beside(name: str, maps: Maps) -> Claim:
    ran = np.isnan(maps.of["stroke_m"])
    kpa = maps.asked.pressure_pa / 1e3
    where = [f"{p:.0f}" for p, share in zip(kpa, ran.mean(axis=0), strict=True) if share > 0.5]
    why = {
        "serial_eq8": (
            "C3 (dL/dt)^2 takes force away in either direction of motion; at the speeds asked for"
            " it is larger than all the rest, and the load pulls the mass away."
        ),
        "serial_eq8_no_c3": (
            "Without C3 the damping C2 P + C4 P^2 is left, which turns negative above a normalised"
            " pressure of 1.158."
        ),
        "serial_eq8_bounded": (
            "Held in its range it does not run away, but its force saturates with speed: at high"
            " frequencies the motor has to move more than the mass."
        ),
    }.get(name, "")
    most = 0.0
    if ran.all():
        ours = (
            f"runs away at all {ran.size} points, within"
            f" {np.nanmax(maps.of['runaway_s']) * 1e3:.0f} ms"
        )
    else:
        best = (
            maps.best_pressure_pa("stroke_m")[np.argmin(np.abs(maps.asked.frequency_rad_s - 80.0))]
            / 1e3
        )
        most = 50.0 * np.nanmax(maps.of["stroke_m"]) / maps.asked.amplitude_m
        ours = (
            f"runs away at {ran.sum()} of {ran.size} points"
            + (f" ({', '.join(where)} kPa)" if where else "")
            + (
                f"; at 80 rad/s best at {best:.0f} kPa; the motor moves up to {most:.0f} % of the"
                " mass motion"
                if np.isfinite(best)
                else ""
            )
        )
    return Claim(
        "2.2, eq. (8)",
        f"Eq. (8) simulates the serial actuator ({name})",
        ours,
        False if ran.any() or most > 100.0 else None,
        why,
    )
