"""Every broken file is answered by one sentence with file, line, found and expected, and starts
nothing.
"""

import re

import pytest
from broken_files import EXPERIMENTS, PLANTS, RIGS, Broken
from broken_others import EXPERIMENT, PLANT
from broken_rig_roles import ROLES
from broken_rig_wiring import BUS, ROWS, STARTUP
from broken_rigs import SHAPE, UNITS

from epa_rt.cli.main import main

RIG = [*UNITS, *SHAPE, *BUS, *STARTUP, *ROWS, *ROLES]
FOLDER = {
    **dict.fromkeys((b.name for b in RIG), RIGS),
    **dict.fromkeys((b.name for b in PLANT), PLANTS),
    **dict.fromkeys((b.name for b in EXPERIMENT), EXPERIMENTS),
}
ALL = [*RIG, *PLANT, *EXPERIMENT]


def written(broken: Broken, folder) -> tuple:
    """The broken file in a folder of its own, and the line that is to be named."""
    text = broken.text((FOLDER[broken.name] / broken.of).read_text(encoding="utf-8"))
    path = folder / broken.of
    path.write_text(text, encoding="utf-8")
    return path, broken.line(text)


def assert_one_sentence(said: str, verb: str, path, line: int, found: str, expected: str) -> None:
    assert said.count("\n") == 1 and said.endswith("\n"), said
    assert said.isprintable() or said[:-1].isprintable()
    assert said.startswith(f"epa {verb}: {path}:{line}: "), f"{said} (expected line {line})"
    before, wanted = re.search(r"found (.*), expected (.*)", said).groups()
    assert found in before and expected in wanted, said


def test_there_are_enough_and_each_is_its_own():
    assert len(RIG) >= 45 and len(PLANT) >= 20 and len(EXPERIMENT) >= 10
    assert len({b.name for b in ALL}) == len(ALL)


@pytest.mark.parametrize("broken", ALL, ids=lambda b: b.name)
def test_check_answers_with_one_sentence(broken, tmp_path, capsys):
    path, line = written(broken, tmp_path)
    rig = ["--rig", str(RIGS / "bench.yaml")] if broken in EXPERIMENT else []
    assert main(["check", str(path), *rig]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert_one_sentence(captured.err, "check", path, line, broken.found, broken.expected)


@pytest.mark.parametrize("broken", [*RIG[::8], *PLANT[::8], *EXPERIMENT[::6]], ids=lambda b: b.name)
def test_run_answers_the_same_and_leaves_no_log(broken, tmp_path, capsys):
    path, line = written(broken, tmp_path)
    out = tmp_path / "out"
    rig = path if broken in RIG else RIGS / "bench.yaml"
    plant = path if broken in PLANT else PLANTS / "bench.yaml"
    experiment = path if broken in EXPERIMENT else EXPERIMENTS / "identification_short.yaml"
    assert (
        main(["run", str(experiment), "--rig", str(rig), "--plant", str(plant), "-o", str(out)])
        == 2
    )
    assert_one_sentence(capsys.readouterr().err, "run", path, line, broken.found, broken.expected)
    assert not out.exists()


@pytest.mark.parametrize(
    ("name", "content", "found"),
    [
        ("empty.yaml", b"", "an empty file"),
        ("comment.yaml", b"# nothing but this\n", "an empty file"),
        ("list.yaml", b"- rig\n- bus\n", "a list or a single value"),
        ("word.yaml", b"rig\n", "a list or a single value"),
        ("binary.yaml", b"rig: \xff\xfe\x00\n", "not UTF-8"),
        ("zeros.yaml", b"\x00" * 100, "U+0000"),
        ("huge.yaml", b"# " + b"x" * (1 << 20), "more than 1 MB"),
        ("two.yaml", b"rig: a\n---\nrig: b\n", "another document"),
        ("nothing_known.yaml", b"robot: x\n", "none of the keys rig, experiment, plant"),
        (
            "bomb.yaml",
            b"a: &a [1, 2]\n"
            + b"".join(
                b"%c: &%c [*%c, *%c, *%c, *%c, *%c, *%c, *%c, *%c]\n" % (c + 1, c + 1, *[c] * 8)
                for c in range(97, 105)
            ),
            "more than 50000 values",
        ),
    ],
)
def test_files_that_hold_no_rig(name, content, found, tmp_path, capsys):
    path = tmp_path / name
    path.write_bytes(content)
    assert main(["check", str(path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"epa check: {path}:") and said.count("\n") == 1 and found in said


def test_what_is_no_file(tmp_path, capsys):
    for path, found in (
        (tmp_path, "a folder"),
        (tmp_path / "none.yaml", "no such file"),
        (tmp_path / ("x" * 300), "cannot be read"),
    ):
        assert main(["check", str(path)]) == 2
        said = capsys.readouterr().err
        assert found in said and ", expected a YAML file" in said and said.count("\n") == 1


def test_a_plant_that_the_rig_names_and_is_not_there(tmp_path, capsys):
    for plant, found in (
        ("../plants/none.yaml", "no such file"),
        ('"a\\0b.yaml"', "a path that cannot be one"),
    ):
        path = tmp_path / "bench.yaml"
        path.write_text(
            (RIGS / "bench.yaml")
            .read_text(encoding="utf-8")
            .replace("../plants/bench.yaml", plant),
            encoding="utf-8",
        )
        assert (
            main(
                [
                    "run",
                    str(EXPERIMENTS / "step.yaml"),
                    "--rig",
                    str(path),
                    "-o",
                    str(tmp_path / "out"),
                ]
            )
            == 2
        )
        said = capsys.readouterr().err
        assert found in said and (found != "no such file" or f"{path}:7: plant: found" in said)
        assert not (tmp_path / "out").exists()
