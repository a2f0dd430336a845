"""Every benchmark and the fuzz of files run once on a small size, so that none rots."""

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from scripts.constants import Constant, altered, changed
from sim_backend.bus.namespace import refusal

ROOT = Path(__file__).resolve().parents[1]


def run(words: list[str], folder: Path) -> str:
    """Runs a script from another folder; its standard output."""
    bare = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    name, *options = words
    done = subprocess.run(
        [sys.executable, ROOT / f"scripts/{name}.py", *options],
        cwd=folder,
        env=bare,
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, (done.stdout, done.stderr)
    return done.stdout


@pytest.mark.parametrize(
    "command",
    [
        "bench_cycle --cycles 1500 --paced-cycles 300",
        "bench_plant bench --seconds 0.5 --repeats 1 --no-scipy",
        "bench_log --samples 4096 --repeats 2",  # twice: it met its own file of the repeat before
        "bench_identify 1",
        "bench_calibrate --tries 1 --pressure-tries 1 --spoilt 1",
        "bench_compare --seeds 1 --rigs bench --leaks 1e-3",
        "seeded_faults --machines piston --faults healthy --speeds one_speed --runs 3",
        # of its kinds the one that takes least; tests/test_outsiders.py makes a machine of each
        "several_effects --kind chamber --machines 1 --effects 1",
        # a plant tuned and tried, some 15 s: the plant's own margins are asked nowhere else
        pytest.param("tune_plants --rigs bench --plants 1 --jobs 1", marks=pytest.mark.slow),
        # a diagnosis with the whole catalogue, a minute on a busy machine
        pytest.param("bench_gap --logs 1 --seconds 10", marks=pytest.mark.slow),
    ],
    ids=lambda command: command.split()[0],
)
def test_a_benchmark_gives_its_figures(command, tmp_path):
    assert json.loads(run(command.split(), tmp_path))


@pytest.mark.network
@pytest.mark.xdist_group("bench_bus")
def test_the_benchmark_of_the_bus_gives_its_figures(tmp_path):
    reason = refusal()
    if reason is not None:
        pytest.skip(reason)
    out = tmp_path / "figures.json"
    run(["bench_bus", "--seconds", "0.5", "--slices", "1", "--json", str(out)], tmp_path)
    assert json.loads(out.read_text())


def test_damaged_files_and_logs_are_answered(tmp_path):
    words = ["fuzz_files", "--files", "16", "--logs", "4", "--keep", str(tmp_path / "found")]
    found = json.loads(run(words, tmp_path))
    for part in ("files", "logs"):
        assert found[part]["findings"] == [] and found[part]["most_mb"] < 500
    assert sum(found["logs"]["answers"].values()) == 4


SHARED = ROOT.parent / "shared/data/zillen_pneumatic/chambers"


@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared recordings are not beside this one")
def test_stability_is_counted_and_goes_on_after_an_interruption(tmp_path):
    words = "stability -o answers --recordings chamber_010 --kinds trials seed"
    first = json.loads(run(words.split(), tmp_path))
    lines = (tmp_path / "answers.jsonl").read_text()
    assert first["all"]["asked"] == 2 and set(first["by_kind"]) == {"trials", "seed"}
    assert first["not_asked"] == {"logs as trials of one: there is one log": 1}
    (tmp_path / "answers.jsonl").write_text(lines + '\n{"recording": "cut o')
    assert json.loads(run(words.split(), tmp_path)) == first
    assert (tmp_path / "answers.jsonl").read_text().startswith(lines)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared recordings are not beside this one")
def test_a_constant_is_asked_for_with_another_value(tmp_path):
    words = "constants -o answers --recordings chamber_010 --constants decide.ALARM --factors 2"
    found = json.loads(run(words.split(), tmp_path))
    assert (found["constants"], found["asked"]) == (1, 1)
    lines = [json.loads(one) for one in (tmp_path / "answers.jsonl").read_text().split("\n") if one]
    assert [one["change"] for one in lines] == ["as given", "posterior.decide.ALARM x 2"]


def test_a_changed_constant_is_another_number_and_every_other_stays():
    source = "A, B = (15, 0.5)\nC = np.log(0.05)\nD = 3.0\n"

    def after(name, place, factor):
        return ast.unparse(altered(source, Constant("room", name, place, ""), factor)).split("\n")

    assert after("A", 0, 2.0) == ["A, B = (30, 0.5)", "C = np.log(0.05)", "D = 3.0"]
    assert after("B", 1, 2.0)[0].startswith("A, B = (15, 0.66")
    assert after("C", None, 0.5)[1] != "C = np.log(0.05)" and after("D", None, 0.5)[2] == "D = 1.5"
    assert (changed(1, 0.5), changed(2, 0.5), changed(0.0, 2.0)) == (1, 1, 0.0)
