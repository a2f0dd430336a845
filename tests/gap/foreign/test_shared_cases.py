"""Recordings and replays of others whose answer was wrong once: the posterior names what is known
of them, and nothing else with confidence. Through the import and the checks of the command line.
"""

from pathlib import Path

import pytest

from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.diagnose import diagnose_logs
from epa_rt.logs.importers.log_of import log_of

CASES = Path(__file__).resolve().parents[4] / "shared/cases"


def imported(folder: Path, mapping: Path, files: list[Path]) -> list[Path]:
    return [log_of(mapping, [file], folder / f"{file.stem}.mcap") for file in files]


def answer(tmp_path: Path, rig: Path, mapping: Path, fit: list[Path], hold: list[Path]):
    if not CASES.exists():
        pytest.skip("the cases are not beside the checkout (../shared/cases)")
    logs, held = (imported(tmp_path, mapping, files) for files in (fit, hold))
    return diagnose_logs(rig, None, logs, held)[1]


def replayed(tmp_path: Path, name: str):
    at = CASES / "replays"
    several = name == "pace13"
    return answer(
        tmp_path,
        at / f"{name}.rig.yaml",
        at / f"{name}.map.yaml",
        [at / (f"{name}_fit.csv" if several else f"{name}.csv")],
        [at / f"{name}_hold.csv"] if several else [],
    )


@pytest.mark.parametrize(
    ("name", "families", "numbers"),
    [
        ("cog84", {"friction", "cogging"}, {"drive.cogging_periods": 84.0}),
        ("mjx1344", {"load", "friction"}, {"friction.coulomb_nm": 3.0e-3}),
        (
            "pace13",
            {"load", "limit", "delay", "deadband"},
            {"drive.deadband_rad": 0.010, "load.gravity_sine_rad_s": 1.2},
        ),
        ("soarm134", {"friction", "backlash"}, {}),
    ],
)
def test_a_replay_is_named_by_what_was_put_into_it(tmp_path, name, families, numbers):
    said = replayed(tmp_path, name)
    assert {one.family for one in said.effects if one.confidence > 0.8} == families
    found = {one.name: one.value for effect in said.effects for one in effect.parameters}
    for key, value in numbers.items():
        assert found[key] == pytest.approx(value, rel=0.05)


def test_a_joint_that_never_moves_tells_what_its_friction_is_at_least(tmp_path):
    at = CASES / "replays"
    if not at.exists():
        pytest.skip("the cases are not beside the checkout (../shared/cases)")
    from epa_rt.gap.rig.foreign import open_foreign
    from epa_rt.gap.rig.foreign.rests import check_rests
    from epa_rt.gap.rig.read import read_recording

    logs = imported(tmp_path, at / "franka249.map.yaml", [at / "franka249.csv"])
    rig = at / "franka249.rig.yaml"
    (finding,) = check_rests([read_recording(logs[0])], open_foreign(rig))
    assert "dry friction is 0.8 N*m at least" in finding.says
    with pytest.raises(VerbError, match="found no stretch of these logs"):
        diagnose_logs(rig, None, logs)


@pytest.mark.parametrize(  # 1/s: two spreads above what was guessed, and as it was
    "gain", ("16.8", pytest.param("12", marks=pytest.mark.slow))
)
def test_a_pendulum_against_a_guessed_plant_has_gravity(tmp_path, gain):
    at = CASES / "real/xl330"
    for name in ("rig.yaml", "plant.yaml"):
        text = (at / name).read_text(encoding="utf-8")
        (tmp_path / name).write_text(text.replace("gain: 12 1/s", f"gain: {gain} 1/s"))
    assert f"gain: {gain} 1/s" in (tmp_path / "plant.yaml").read_text()
    rig, logs = tmp_path / "rig.yaml", sorted(at.glob("k*.csv"))
    said = answer(tmp_path, rig, at / "map.yaml", logs, [])
    # where it sticks under its load the catalogue has play and dry friction, and neither is enough:
    # with gravity they leave a sixth of the gap, as much as wrong laws do
    families = said.posterior.families
    assert next(iter(families)) == "load" and families["load"] > 0.4 and "ravity" in said.says
    assert [name for name, share in families.items() if share >= 0.8] in ([], ["load"])


def trials_of(path: Path, numbers: range, out: Path) -> Path:
    """The rows of some trials of a file whose last column numbers them."""
    head, *rows = path.read_text(encoding="utf-8").splitlines()
    kept = [row for row in rows if int(row.rpartition(",")[2]) in numbers]
    out.write_text("\n".join([head, *kept]) + "\n", encoding="utf-8")
    return out


@pytest.mark.parametrize(
    ("fit", "hold"),
    (
        (range(12, 24), range(1, 4)),  # those of 2 s or more
        pytest.param(range(1, 24), range(1, 10), marks=pytest.mark.slow),
    ),
)
def test_a_servo_s_trials_in_one_file_show_its_speed_limit(tmp_path, fit, hold):
    at = CASES / "real/mauicv_servo"
    if not at.exists():
        pytest.skip("the cases are not beside the checkout (../shared/cases)")
    parts = [
        trials_of(at / f"{name}.csv", numbers, tmp_path / f"{name}.csv")
        for name, numbers in (("fit", fit), ("hold", hold))
    ]
    said = answer(tmp_path, at / "rig.yaml", at / "map.yaml", parts[:1], parts[1:])
    assert said.verdict == "partly_explained"
    assert [one.name for one in said.effects] == ["speed_limit"]
    assert said.effects[0].confidence > 0.8
