"""A few rows of docs/faults.md: what a fault does to the rig, by the rig's own figures."""

import importlib.util
from pathlib import Path

import pytest

from epa_rt.config.rig import load_rig
from sim_backend.faults import PLANT_FAULTS
from tests.faults.trial import Fault, run_trial

ROOT = Path(__file__).resolve().parents[2]
AT_REST_M_S = 0.005


def script():
    spec = importlib.util.spec_from_file_location("rig_faults", ROOT / "scripts/rig_faults.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("rig", "fault", "moment"),
    [
        ("bench", Fault("wire_broken", "muscle_force_n"), "at full stretch"),
        ("bench_analog", Fault("wire_broken", "muscle_pressure_pa"), "at speed"),
        ("mass", Fault("toggle_frozen", "analog_in"), "at full stretch"),
        ("knee", Fault("Ctrl-C"), "at speed"),
    ],
)
def test_with_drive_bus_and_position_sound_nothing_leaves_its_limits(rig, fault, moment):
    figures = run_trial(rig, fault, moment)
    assert figures.injected
    assert (
        script().outside(figures, script().limits_of(load_rig(ROOT / f"config/rigs/{rig}.yaml")))
        == []
    )
    assert figures.speed_at_power_off_m_s < AT_REST_M_S
    assert figures.vented_s is not None and figures.rest_s is not None


def test_without_torque_the_motor_is_thrown_and_it_is_said():
    figures = run_trial("bench", Fault("sto"), "at full stretch")
    assert figures.category.startswith("stop category 0") and "stored then" in figures.category
    assert figures.power_off_s < 0.02 and figures.fastest_m_s > 0.15
    assert figures.vented_s is not None and figures.code == 3


def test_the_pages_hold_every_kind_of_fault_and_every_rig():
    text = (ROOT / "docs/faults.md").read_text(encoding="utf-8")
    others = [ROOT / f"docs/{name}.md" for name in ("sensors", "bus-faults")]
    pages = text + "".join(page.read_text(encoding="utf-8") for page in others)
    assert [kind for kind in PLANT_FAULTS if kind not in pages] == []
    assert all(f"\n## {rig}\n" in text for rig in script().RIGS)
