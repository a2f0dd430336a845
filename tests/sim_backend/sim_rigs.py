"""The delivered rigs with their plants, and a simulated one driven by named signals."""

from functools import cache
from pathlib import Path

import numpy as np

from epa_rt.config.rig import Rig, load_rig, rig_from
from epa_rt.config.source import parse_yaml
from epa_rt.models.plant_file import load_plant
from epa_rt.signals.codec import Decoder, Encoder
from sim_backend.rig_model import RigModel

ROOT = Path(__file__).resolve().parents[2]
NAMES = ("bench", "bench_analog", "knee", "mass")


@cache
def rig(name: str) -> Rig:
    return load_rig(ROOT / "config" / "rigs" / f"{name}.yaml")


def edited(name: str, *edits: tuple[str, str]) -> Rig:
    text = (ROOT / "config" / "rigs" / f"{name}.yaml").read_text(encoding="utf-8")
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    return rig_from(parse_yaml(text, f"{name}.yaml"))


class Driven:
    """A rig model between codec halves: named commands in, named signals out."""

    def __init__(self, on: Rig | str, seed: int = 1, **more: int):
        self.rig = rig(on) if isinstance(on, str) else on
        plant = load_plant(ROOT / "config" / "rigs" / self.rig.plant)
        self.model = RigModel(self.rig, plant, seed, **more)
        self.encoder, self.decoder = Encoder(self.rig), Decoder(self.rig)
        self.command = dict(self.encoder.safe)

    def cycle(self, **command: float) -> dict[str, float]:
        self.command |= command
        return self.decoder.decode(self.model.cycle(self.encoder.encode(self.command)))

    def cycles(self, n: int, **command: float) -> dict[str, float]:
        for _ in range(n):
            measured = self.cycle(**command)
        return measured

    def enable(self, mode: int) -> "Driven":
        """Powered in a mode, targets where the rig is."""
        self.cycles(round(0.022 / self.rig.period_s))
        for word in (0x06, 0x07, 0x0F):
            self.cycles(
                2,
                cmd_drive_control_raw=word,
                cmd_drive_mode_raw=mode,
                cmd_motor_travel_m=self.decoder.measured["motor_travel_m"],
            )
        assert int(self.decoder.measured["drive_status_raw"]) & 0x6F == 0x27
        return self

    @property
    def plant_command(self) -> np.void:
        return self.model.command[0]
