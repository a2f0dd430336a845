"""docs/add-an-effect.md, followed as it stands: its file adds an effect, which is then named in a
recording of a simulator that knows nothing of this package.
"""

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from epa_rt.config.source import ConfigError
from epa_rt.gap.rig.foreign import laws
from epa_rt.gap.rig.foreign.kinds import KINDS
from epa_rt.gap.rig.foreign.sound_law import asked_of_a_trial, check_said
from epa_rt.gap.rig.foreign.terms import LAWS

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "add-an-effect.md").read_text(encoding="utf-8")
EXAMPLE = re.search(r"^```python\n(.*?)^```", PAGE.split("## To a rig of others")[1], re.M | re.S)
STARTS = "starts=((0.5, BEGINS), (0.5, -BEGINS), (-0.5, BEGINS))"
STIFFNESS_N_M, BEGINS_M, HALF_STROKE_M = 400.0, 0.03, 0.08
# command lines, one after the other, with one more folder to look for laws in
EPA = """
import json, sys
from epa_rt.gap.rig.foreign import laws
laws.__path__.append(sys.argv[1])
from epa_rt.cli.main import main
for line in json.loads(sys.argv[2]):
    if main(line.split()):
        sys.exit(line)
"""
RIG = """rig: cart
kind: carriage
plant: plant.yaml
rate: 50 Hz
lowpass: 20 Hz
channels: {position: place_m, force: drive_n}
settings: {typical_force: 20 N, typical_speed: 0.15 m/s, stroke: 0.16 m}
"""
PLANT = """plant: cart
kind: carriage
carriage: {inertia: 4 kg}
friction: {viscous: 20 N*s/m}
"""
MAPPING = """mapping: cart
description: a carriage behind its motor
rig: cart
experiment: sines
format: {kind: csv, delimiter: ","}
clock: {column: t, unit: s, period: 2 ms}
measured:
  place_m: {column: x, unit: mm}
  drive_n: {column: u, unit: N}
"""


def example() -> str:
    assert EXAMPLE is not None
    return EXAMPLE.group(1)


def record(path: Path, seed: int, strokes_m: tuple[float, float], hz: tuple[float, float]) -> None:
    """What a drive must give a carriage of 4.1 kg with drag and a bumper to follow two sines, with
    the noise and the steps of its sensors.
    """
    t, random = np.arange(0.0, 10.0, 0.002), np.random.default_rng(seed)
    place, speed, acceleration = np.zeros((3, len(t)))
    for stroke, w in zip(strokes_m, 2.0 * np.pi * np.asarray(hz), strict=True):
        place += stroke * np.sin(w * t)
        speed += stroke * w * np.cos(w * t)
        acceleration -= stroke * w**2 * np.sin(w * t)
    bumper = np.where(place > BEGINS_M, STIFFNESS_N_M * (place - BEGINS_M), 0.0)
    force = 4.1 * acceleration + 22.0 * speed + bumper + random.normal(0.0, 0.05, len(t))
    read = 1e3 * (place + random.normal(0.0, 1e-6, len(t)))
    np.savetxt(
        path,
        np.c_[t, np.round(read / 2e-3) * 2e-3, force],
        delimiter=",",
        header="t,x,u",
        comments="",
        fmt=("%.3f", "%.3f", "%.4f"),
    )


def epa(folder: Path, *lines: str) -> None:
    """Runs ``epa`` with each of ``lines`` in ``folder``, whose ``laws`` it knows too. Fails where
    one does.
    """
    done = subprocess.run(
        [sys.executable, "-c", EPA, str(folder / "laws"), json.dumps(lines)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


def test_the_example_of_the_page_is_short_and_its_effect_is_named(tmp_path):
    assert len(example().splitlines()) < 60
    (tmp_path / "laws").mkdir()
    for name, text in (
        ("laws/bumper.py", example()),
        ("rig.yaml", RIG),
        ("plant.yaml", PLANT),
        ("mapping.yaml", MAPPING),
    ):
        (tmp_path / name).write_text(text, encoding="utf-8")
    record(tmp_path / "one.csv", 1, (0.06, 0.02), (0.4, 1.3))
    record(tmp_path / "two.csv", 2, (0.05, 0.03), (0.7, 0.25))
    epa(
        tmp_path,
        "import mapping.yaml one.csv -o one.mcap",
        "import mapping.yaml two.csv -o two.mcap",
        "gap diagnose --rig rig.yaml one.mcap --holdout two.mcap --no-plan --json gap.json",
    )
    answer = json.loads((tmp_path / "gap.json").read_text(encoding="utf-8"))
    assert answer["verdict"] == "explained"
    (found,) = answer["effects"]
    assert found["name"] == "bumper" and found["confidence"] > 0.9
    strength, begins = (number["value"] for number in found["parameters"])
    assert strength == pytest.approx(STIFFNESS_N_M * HALF_STROKE_M, rel=0.02)
    assert begins == pytest.approx(BEGINS_M / HALF_STROKE_M, rel=0.02)


def test_the_page_says_first_what_one_file_can_add():
    begins = PAGE.split("## To a rig of others")[0]
    for word in ("carriage", "shaft", "piston", "without memory", "chamber", "servo", "state"):
        assert word in begins, word


def test_the_page_has_its_environment_before_its_first_command():
    """And what to do where another checkout's ``epa`` does not know the law."""
    begins = re.split(r"^    (?:epa|python) ", PAGE, maxsplit=1, flags=re.M)[0]
    for said in ("    source .venv/bin/activate\n", "`epa gap catalogue`", "PYTHONPATH=$PWD"):
        assert said in begins, said


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("import numpy as np", "import numpi as np", ":3: found ModuleNotFoundError"),
        ("def force_n(", "def force_n((", ":11: found SyntaxError"),
        ("force_n=force_n,", "force=force_n,", "found TypeError"),
        ("LAW = law(", "OTHER = law(", "found no LAW, expected LAW = law("),
        ('name="bumper"', 'name="coulomb"', "a name that no other effect has"),
        ("bumper_begins_ratio", "coulomb_n", "a name that no other number has"),
        ("neutral=BEGINS", "neutral=3.0", "within its bounds"),
        ('scale="typical_force"', 'scale="typical_force", neutral=1.0', "its strength"),
        ("starts=((0.5, BEGINS)", "starts=((0.5,)", "each of bumper_n, bumper_begins_ratio"),
        (STARTS, "starts=()", ":28: bumper: found starts ()"),
        (STARTS, "starts=(0.5, BEGINS)", ":28: bumper: found a start 0.5"),
        ('"typical_force"', '"typical_forse"', ":24: bumper: found a scale with 'typical_forse'"),
        ('bumper_n"] *', 'bumber_n"] *', ":13: bumper: found number 'friction.bumber_n'"),
        ("m.place_ratio", "m.placeratio", ":13: bumper: found AttributeError"),
        ("return n[", "return 0.0  # n[", ":11: bumper: found a force 0.0"),
        ("starts=((0.5", "starts=((-50", ":28: bumper: found a start of 'bumper_n' at -50"),
        ('"bumper_n", "N"', '"bumper_n", "foo"', ":24: bumper: found 'bumper_n' with unit 'foo'"),
        ('"bumper_n", "N"', '"bumper_n", "m"', "a name that ends in its unit, _m"),
        ('"bumper_n", "N"', '"bumper_n", "kN"', "an SI unit such as"),
        ('"bumper_begins_ratio"', '"bumper_begins"', "a name that ends in its unit, _ratio"),
        ("spread=0.5", "spread=0", ":24: bumper: found 'friction.bumper_n' spread 0"),
        ("return n[", "return 1.0 + n[", ":11: bumper: found a force of 1 N at"),
        ("m.place_ratio -", "m.place_ratio / 0 -", ":11: bumper: found a force that is not finite"),
    ],
)
def test_a_file_that_is_wrong_is_named_with_what_is_expected(old, new, says, tmp_path, monkeypatch):
    assert old in example()
    (tmp_path / "wrong.py").write_text(example().replace(old, new), encoding="utf-8")
    monkeypatch.setattr(laws, "__path__", [str(tmp_path)])
    monkeypatch.delitem(sys.modules, f"{laws.__name__}.wrong", raising=False)
    with pytest.raises(ConfigError, match="wrong.py.*" + re.escape(says)):
        laws.found(LAWS)
    sys.modules.pop(f"{laws.__name__}.wrong", None)


def test_a_law_that_asks_for_a_screw_s_pitch_is_none_of_a_piston(tmp_path, monkeypatch):
    text = example().replace('scale="typical_force"', 'scale="typical_force*pitch/pitch"')
    for name, written in (("with_pitch.py", text), ("without.py", example())):
        (tmp_path / name).write_text(written, encoding="utf-8")
        monkeypatch.setattr(laws, "__path__", [str(tmp_path)])
        (found,) = laws.found(LAWS)
        assert found.asks == ({"pitch"} if name == "with_pitch.py" else set())
        sys.modules.pop(f"{laws.__name__}.{Path(name).stem}", None)
        (tmp_path / name).unlink()


def test_every_law_of_the_catalogue_is_sound():
    for law in LAWS:
        check_said(law, (), ())
        assert not asked_of_a_trial(law, LAWS)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('"bumper"', '"backlash"', ":17: found effect 'backlash'"),
        ('"bumper_n", "N"', '"load_ratio", "1"', ":24: found number 'friction.load_ratio'"),
    ],
)
def test_a_name_that_a_carriage_has_is_said_with_the_file(old, new, says, tmp_path, monkeypatch):
    text = example().replace(old, new)
    if "load_ratio" in new:
        text = text.replace("friction.bumper_n", "friction.load_ratio")
    (tmp_path / "taken.py").write_text(text, encoding="utf-8")
    monkeypatch.setattr(laws, "__path__", [str(tmp_path)])
    (law,) = laws.found(LAWS)
    sys.modules.pop(f"{laws.__name__}.taken", None)
    one = KINDS["carriage"]
    with pytest.raises(ConfigError, match="taken.py" + re.escape(says)):
        replace(
            one, effects=(*one.effects, law.effect), parameters=(*one.parameters, *law.parameters)
        )
