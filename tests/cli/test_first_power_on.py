"""docs/first-power-on.md against the program: its commands parse, and each rig that it has one
write is one that protects.
"""

import re
import shlex

import pytest

from epa_rt.cli.main import parser
from epa_rt.cli.sound_rig import sound_rig
from epa_rt.cli.zero import load_rig_source
from tests.cli.shell import ROOT, epa_here

PAGE = (ROOT / "docs/first-power-on.md").read_text(encoding="utf-8")
STEPS = re.split(r"^## (?=\d)", PAGE, flags=re.M)[1:]
JOG = re.search(r"`JOG` stands for `(epa jog [^`]*)`", PAGE.replace("\n", " ")).group(1)
NEW_ZERO = re.search(r"`(zero: \{[^`]*\})`", PAGE).group(1)
PRESSURES = [  # by step: what the page has one write into a muscle
    (step[0], most.group(1), supply.group(1))
    for step in STEPS
    if (most := re.search(r"`pressure_max: ([\d.]+ kPa gauge)`", step))
    and (supply := re.search(r"`supply: ([\d.]+ kPa gauge)`", step))
]


def commands():
    """The words of every command that stands whole on the page, and not as a verb's name alone."""
    for code in re.findall(r"`((?:epa|JOG) [^`]*)`", PAGE.replace("\n", " ")):
        if "…" not in code and code != JOG and not re.fullmatch("epa [a-z ]+", code):
            yield shlex.split(re.sub(r"^JOG", JOG, code))[1:]


def test_every_command_parses():
    found = list(commands())
    assert len(found) >= 12
    for words in found:
        parser().parse_args(words)  # raises SystemExit where it does not


def rig_of_the_page(name, most, supply):
    text = (ROOT / f"config/rigs/{name}.yaml").read_text(encoding="utf-8")
    text = re.sub(r"^(  )zero: \{.*?\}", rf"\g<1>{NEW_ZERO}", text, flags=re.M | re.DOTALL)
    assert NEW_ZERO in text
    text = re.sub(r"pressure_max: [\d.]+ kPa gauge", f"pressure_max: {most}", text)
    text = re.sub(r"supply: [\d.]+ kPa gauge", f"supply: {supply}", text)
    return text.replace("../plants/", f"{ROOT}/config/plants/")


@pytest.mark.parametrize("name", ["bench", "knee"])
@pytest.mark.parametrize(("step", "most", "supply"), PRESSURES, ids=lambda value: value[:1])
def test_the_rigs_of_the_day_protect(name, step, most, supply, tmp_path):
    assert [one[0] for one in PRESSURES] == ["4", "6"]
    path = tmp_path / "rig.yaml"
    path.write_text(rig_of_the_page(name, most, supply))
    rig = sound_rig(load_rig_source(path, with_zero=False)[0]).rig  # raises where it does not
    assert {shown(muscle.pressure_max, rig) for muscle in rig.muscles} == {most}
    assert {shown(muscle.valves.supply, rig) for muscle in rig.muscles} == {supply}


def shown(pressure_pa, rig):
    return f"{(pressure_pa - rig.atmosphere_pa) / 1e3:.6g} kPa gauge"


def test_the_first_fill_goes_as_the_page_says(tmp_path):
    path = tmp_path / "bench.yaml"
    path.write_text(rig_of_the_page("bench", *PRESSURES[0][1:]))
    words = next(words for words in commands() if "--fill" in words)
    words = shlex.split(
        shlex.join(words)
        .replace("RIG", str(path))
        .replace("--backend ethercat --interface IF", "--backend sim")
        .replace("out/first", str(tmp_path))
    )
    done = epa_here(*words, "--quiet")
    assert done.returncode == 0 and "(at rest; vented)" in done.stdout, done.stderr
