"""Rivals keep to their budgets and answer in the diagnosis' own words."""

import numpy as np
import pytest

from epa_rt.gap.blind import rivals
from epa_rt.gap.blind.arena import Arena, windows
from epa_rt.gap.recording import Recording, Span

LIBRARY = {"cma_es": "cma", "sparse": "pysindy"}


def test_windows_are_short_and_lie_in_trials():
    n = 30000
    recording = Recording("r", "", "", "", "", 1e-3, np.arange(n), {"x": np.arange(n, dtype=float)}, (Span("a", 2000, 12000, True), Span("b", 12000, 20000, False),
                                                                                                  Span("c", 20000, 23000, True)))
    found = windows(recording, 3)
    assert len(found) == 3
    for part in found:
        assert 3000 <= part.samples <= 4000
        assert np.array_equal(part.columns["x"], part.cycle)
        assert 2000 <= part.cycle[0] < part.cycle[-1] < 12000 or 20000 <= part.cycle[0] < part.cycle[-1] < 23000


@pytest.mark.parametrize("name", ["cma_es", "least_squares", "sparse", "rmse"])
def test_every_rival_answers_within_its_budget(short_case, monkeypatch, name):
    if name in LIBRARY:
        pytest.importorskip(LIBRARY[name], reason=f"{LIBRARY[name]} is not installed (pip install epa_rt[rivals])")
    monkeypatch.setattr(rivals, "CMA_EVALUATIONS", 40)
    monkeypatch.setattr(rivals, "ROUNDS", 2)
    folder, _ = short_case
    said = getattr(rivals, name)(folder / "rig.yaml", folder / "plant.yaml", [folder / "logs" / "log_a.mcap"], [], ["leak"])
    assert said["verdict"] in ("explained", "no_gap")
    assert {"block", "channel"} <= said["location"][0].keys()
    assert all({"name", "family", "block", "confidence"} <= effect.keys() and effect["name"] != "leak" for effect in said["effects"])
    assert said.get("evaluations", 0) <= (60 if name == "cma_es" else 400)


def test_columns_of_the_jacobian_are_differences_of_the_whole_residual(short_case):
    folder, _ = short_case
    arena = Arena(folder / "rig.yaml", folder / "plant.yaml", [folder / "logs" / "log_a.mcap"], [], stretches=1)
    z = np.zeros(arena.size)
    table = arena.jacobian(z, 0.02)
    for i in (0, len(arena.nominal), arena.size - 1):
        moved = z.copy()
        moved[i] = 0.02
        assert table[:, i] == pytest.approx((arena.residual(arena.values(moved)) - arena.residual({})) / 0.02, abs=1e-6)
