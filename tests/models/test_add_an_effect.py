"""docs/add-an-effect.md, followed as it stands for the rig of this house: its file adds an effect
of the muscle, absent to the bit in a plant that lacks it, and named where a rig has it.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from epa_rt.config.source import ConfigError
from epa_rt.models import added
from epa_rt.models.catalogue import CATALOGUE
from epa_rt.models.knobs import row_of
from epa_rt.models.room import check_start, check_unit

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "add-an-effect.md").read_text(encoding="utf-8")
EXAMPLE = re.search(
    r"^```python\n(.*?)^```", PAGE.split("## To the rig of this house")[1], re.M | re.S
)
# pulls of one muscle without the effect, and with it, at a stretch that is known
SCRIPT = """
import json, sys
from types import SimpleNamespace
import numpy as np
from epa_rt.models import added
added.__path__.append(sys.argv[1])
from epa_rt.models.blocks.muscle import NO_LOAD, shape, tension
from epa_rt.models.catalogue import BY_NAME, knob, write_knob
from epa_rt.models.parameters import neutral_params
from epa_rt.models.ports import MEMORY
params = neutral_params()
params["muscle"]["present"][0, 0] = 1.0
no_load = float(params["muscle"]["braid_length_m"][0, 0]) * NO_LOAD
stretch, gauge = np.array([0.002, 0.01, 0.02]), np.array([3e5, 3e5, 5e5])
pulls = []
for strength, pressed in ((0.0, 0.0), (0.0, 2e-6), (3e4, 2e-6)):
    write_knob(params, "muscle.seam_n_m2", strength)
    write_knob(params, "muscle.seam_per_pa", pressed)
    one = params["muscle"][0, 0]
    p = SimpleNamespace(**{name: float(one[name]) for name in one.dtype.names})
    pulls.append([
        tension(p, shape(p, 0.0, no_load + x)[1], pa, no_load + x, 0.0, np.zeros(MEMORY), 0.0, 0.0)
        for x, pa in zip(stretch, gauge)
    ])
print(json.dumps({
    "pulls": pulls, "stretch": stretch.tolist(), "gauge": gauge.tolist(),
    "says": BY_NAME["seam"].says, "spread": knob("muscle.seam_n_m2", params).spread,
}))
"""


def example() -> str:
    assert EXAMPLE is not None
    return EXAMPLE.group(1)


def run(*words: str, cwd: Path, root: Path, **environment: str) -> str:
    """What a Python process prints that imports the packages under ``root``."""
    done = subprocess.run(
        [sys.executable, *words],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(root), **environment},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_example_of_the_page_is_short_and_pulls_as_its_law_says(tmp_path):
    assert len(example().splitlines()) < 60
    (tmp_path / "seam.py").write_text(example(), encoding="utf-8")
    # without compiling: the repository's compiled plant knows nothing of this file
    text = run("-c", SCRIPT, str(tmp_path), cwd=tmp_path, root=ROOT, NUMBA_DISABLE_JIT="1")
    found = json.loads(text)
    off, off_too, on = found["pulls"]
    assert off == off_too and found["spread"] == 2e4 and "seams" in found["says"]
    for before, after, stretch, gauge in zip(
        off, on, found["stretch"], found["gauge"], strict=True
    ):
        assert after - before == pytest.approx(3e4 * stretch**2 * (1.0 + 2e-6 * gauge), rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("@compiled", "@compilation", ":7: found NameError"),
        (
            "ADDITION = of_muscle(",
            "OTHER = of_muscle(",
            "found no ADDITION, expected ADDITION = of_muscle(",
        ),
        ("0.0, 1e6,", "1.0, 1e6,", "within its bounds"),
        ("starts=((2e4, 0.0)", "starts=((2e4,)", "a value for each of seam_n_m2, seam_per_pa"),
        ('the seams over squared stretch"', 'the seams", neutral=1.0', "its strength"),
        ("starts=((2e4, 0.0), (2e4, 2e-6))", "starts=()", ":24: seam: found starts ()"),
        (
            'row("seam_n_m2", "N/m^2"',
            'row("viscous_n_s_m", "N*s/m"',
            ":21: seam: found row 'viscous_n_s_m'",
        ),
        ("if p.seam_n_m2", "if p.seam_n_m3", ":10: seam: found AttributeError"),
        ("return 0.0", "return None", ":8: seam: found a pull None"),
        ("return 0.0", "return 1.0", ":8: seam: found a pull of 1 N at seam_n_m2 0"),
        ("@compiled", "", ":8: seam: found tension_n without @compiled"),
        ("starts=((2e4", "starts=((2e9", ":24: seam: found a start of 'seam_n_m2' at 2e+09"),
        ('"N/m^2"', '"foo"', ":21: seam: found 'seam_n_m2' with unit 'foo'"),
        ('"N/m^2"', '"N/m"', "a name that ends in its unit, _n_m"),
        ('name="seam"', 'name="leak"', ":16: leak: found effect 'leak'"),
    ],
)
def test_a_file_that_is_wrong_is_named_with_what_is_expected(old, new, says, tmp_path, monkeypatch):
    assert old in example()
    (tmp_path / "wrong_seam.py").write_text(example().replace(old, new), encoding="utf-8")
    monkeypatch.setattr(added, "__path__", [str(tmp_path)])
    monkeypatch.delitem(sys.modules, f"{added.__name__}.wrong_seam", raising=False)
    with pytest.raises(ConfigError, match="wrong_seam.py.*" + re.escape(says)):
        added.found()
    sys.modules.pop(f"{added.__name__}.wrong_seam", None)


@pytest.mark.slow  # the plant is compiled with the effect, then a bench is diagnosed
def test_a_rig_that_has_it_is_found_to_have_it(tmp_path):
    for name in ("epa_rt", "sim_backend", "drivers", "config"):
        left_out = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, tmp_path / name, ignore=left_out)
    (tmp_path / "epa_rt" / "models" / "added" / "seam.py").write_text(example(), encoding="utf-8")
    plant = (tmp_path / "config" / "plants" / "bench.yaml").read_text(encoding="utf-8")
    (tmp_path / "plant_true.yaml").write_text(
        f"{plant}\neffects:\n  seam: {{seam_n_m2: 30000 N/m^2}}\n", encoding="utf-8"
    )
    rig = ("--rig", "config/rigs/bench.yaml")
    for seed in ("1", "2"):
        words = ("run", "config/experiments/identification_short.yaml", *rig, "--seed", seed)
        more = ("--plant", "plant_true.yaml", "-o", f"{seed}.mcap")
        run("-m", "epa_rt", *words, *more, cwd=tmp_path, root=tmp_path)
    words = ("gap", "diagnose", *rig, "1.mcap", "--holdout", "2.mcap", "--no-plan", "--no-gate")
    run("-m", "epa_rt", *words, "--json", "gap.json", cwd=tmp_path, root=tmp_path)
    answer = json.loads((tmp_path / "gap.json").read_text(encoding="utf-8"))
    named = {found["name"]: found for found in answer["effects"]}
    assert named["seam"]["confidence"] > 0.9
    assert named["seam"]["parameters"][0]["value"] == pytest.approx(3e4, rel=0.02)


def test_every_number_of_an_effect_of_this_house_is_called_as_its_unit_asks():
    for effect in CATALOGUE:
        assert effect.starts
        rows = [row_of(key)[1] for key in effect.knobs]
        for row in rows:
            check_unit(row.name, row.unit)
        for start in effect.starts:
            check_start(start, effect.knobs, [(row.low, row.high) for row in rows])
