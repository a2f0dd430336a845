"""Buses in memory, one per test."""

from pathlib import Path

import pytest

from epa_rt.config.rig import load_rig
from epa_rt.models.plant_file import load_plant
from sim_backend.bus.emulated_bus import EmulatedBus
from tests.bus.emulator.bring_up import Wire

RIGS = Path(__file__).parents[3] / "config" / "rigs"


def bus_of(name: str, **more) -> EmulatedBus:
    rig = load_rig(RIGS / f"{name}.yaml")
    return EmulatedBus(rig, load_plant(RIGS / rig.plant), **more)


@pytest.fixture
def make_bus():
    return bus_of


@pytest.fixture
def bench():
    """The bench in lock step, in INIT."""
    return bus_of("bench", lock_step=True)


@pytest.fixture
def wire(bench):
    """The bench in OP with process data flowing, in lock step."""
    return Wire(bench)
