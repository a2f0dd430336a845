"""Rivals keep to their budgets and answer in the diagnosis' own words."""

from types import SimpleNamespace

import numpy as np
import pytest

from epa_rt.benchmark import rivals
from epa_rt.benchmark.arena import Arena

LIBRARY = {"cma_es": "cma", "sparse": "pysindy"}


@pytest.mark.parametrize("name", ["cma_es", "least_squares", "sparse", "rmse"])
def test_every_rival_answers_within_its_budget(short_case, monkeypatch, name):
    if name in LIBRARY:
        pytest.importorskip(
            LIBRARY[name], reason=f"{LIBRARY[name]} is not installed (pip install epa_rt[rivals])"
        )
    monkeypatch.setattr(rivals, "CMA_EVALUATIONS", 40)
    monkeypatch.setattr(rivals, "ROUNDS", 2)
    folder, _ = short_case
    said = getattr(rivals, name)(
        folder / "rig.yaml", folder / "plant.yaml", [folder / "logs" / "log_a.mcap"], [], ["leak"]
    )
    assert said["verdict"] in ("explained", "no_gap")
    assert {"block", "channel"} <= said["location"][0].keys()
    assert all(
        {"name", "family", "block", "confidence"} <= effect.keys() and effect["name"] != "leak"
        for effect in said["effects"]
    )
    assert said.get("evaluations", 0) <= (60 if name == "cma_es" else 400)


def test_a_sparse_model_is_named_by_an_effect_of_either_sign(monkeypatch):
    """Its terms explain what an effect makes of the residual at the other sign, or at its second
    start; another effect lies half as near.
    """
    near, far = np.array([1.0, -1.0, 0.5, 2.0]), np.array([1.0, 1.0, 1.0, 0.0])
    signatures = {("near", -1.0): -near, ("near", 1.0): far, ("far", 1.0): far + 0.5 * near}
    effects = [
        SimpleNamespace(name="near", starts=((1.0,), (-1.0,))),
        SimpleNamespace(name="far", starts=((1.0,),)),
    ]
    arena = SimpleNamespace(
        links=["p"],
        effects=effects,
        switched=lambda e, start, amplitude: {(e.name, start[0]): amplitude},
        rmse=lambda values: 1.0,
        residual=lambda values: sum((signatures[key] for key in values), np.zeros(4)),
        said=lambda before, after, found: [e.name for e in found],
    )
    monkeypatch.setattr(rivals, "Arena", lambda *_: arena)
    for sign in (1.0, -1.0):
        monkeypatch.setattr(rivals, "_explained", lambda arena, link, sign=sign: sign * near)
        assert rivals.sparse(None, None, [], [], []) == ["near"]


def test_columns_of_the_jacobian_are_differences_of_the_whole_residual(short_case):
    folder, _ = short_case
    arena = Arena(folder / "rig.yaml", folder / "plant.yaml", [folder / "logs" / "log_a.mcap"], [])
    z = np.zeros(arena.size)
    table = arena.jacobian(z, 0.02)
    for i in (0, len(arena.nominal), arena.size - 1):
        moved = z.copy()
        moved[i] = 0.02
        assert table[:, i] == pytest.approx(
            (arena.residual(arena.values(moved)) - arena.residual({})) / 0.02, abs=1e-6
        )


def test_an_amplitude_of_nothing_is_no_effect(short_case):
    """The knobs that only shape an effect stand at their start; those that give it its strength
    grow from neutral.
    """
    folder, _ = short_case
    arena = Arena(folder / "rig.yaml", folder / "plant.yaml", [folder / "logs" / "log_a.mcap"], [])
    nothing = arena.residual({})
    for effect in arena.effects:
        off = arena.residual(arena.switched(effect, effect.starts[0], 1e-6))
        assert np.sqrt(np.mean((off - nothing) ** 2)) < 0.05, effect.name
