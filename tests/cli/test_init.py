"""A wheel carries the files that an operator edits, and epa init writes them into a folder."""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from epa_rt.cli.main import main
from tests.cli.shell import ROOT

PACKAGES = ("epa_rt", "drivers", "sim_backend", "config")
FILES = ("pyproject.toml", "setup.py", "MANIFEST.in")
BUILD = "import sys; from setuptools import build_meta; print(build_meta.build_wheel(sys.argv[1]))"


def shipped() -> set[str]:
    left_out = (".zero.yaml", ".state.json")
    return {
        path.relative_to(ROOT / "config").as_posix()
        for path in (ROOT / "config").rglob("*")
        if path.is_file() and not path.name.endswith(left_out) and path.name[:1] != "."
    }


def written(folder: Path) -> set[str]:
    config = folder / "config"
    return {p.relative_to(config).as_posix() for p in config.rglob("*") if p.is_file()}


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder with the unpacked wheel of this tree."""
    source, target = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("target")
    ignored = shutil.ignore_patterns("__pycache__", "*.nbi", "*.nbc")
    for name in PACKAGES:
        shutil.copytree(ROOT / name, source / name, ignore=ignored)
    for name in FILES:
        shutil.copy(ROOT / name, source)
    command = [sys.executable, "-W", "ignore", "-c", BUILD, str(target)]
    built = subprocess.run(command, cwd=source, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    with zipfile.ZipFile(next(target.glob("*.whl"))) as wheel:
        wheel.extractall(target / "site")
    return target / "site"


def test_an_installed_wheel_is_enough(installed, tmp_path):
    def epa(*words: str) -> subprocess.CompletedProcess:
        command = [sys.executable, "-P", "-m", "epa_rt", *words]
        environment = {"PYTHONPATH": str(installed), "PATH": "/usr/bin:/bin"}
        return subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True
        )

    done = epa("init", "here")
    assert done.returncode == 0, done.stderr
    assert written(tmp_path / "here") == shipped()
    experiment, rig = "here/config/experiments/step.yaml", "here/config/rigs/bench.yaml"
    checked = epa("check", "--rig", rig, experiment, rig)
    assert checked.returncode == 0, checked.stderr
    dry = epa("run", experiment, "--rig", rig, "--dry", "-o", "out")
    assert dry.returncode == 0 and (tmp_path / "out/dry-step-bench.html").exists(), dry.stderr


def test_a_second_time_nothing_is_lost(tmp_path, capsys):
    assert main(["init", str(tmp_path)]) == 0
    rig = tmp_path / "config/rigs/bench.yaml"
    rig.write_text("mine")
    (tmp_path / "config/plants/bench.yaml").unlink()
    capsys.readouterr()
    assert main(["init", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert rig.read_text() == "mine" and f"kept, though it differs: {rig}" in said
    assert "1 files written" in said and written(tmp_path) == shipped()
    assert not list(tmp_path.rglob("*.part"))


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["init", str(tmp_path / "file")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
