"""What setting up compiles still runs: every link and free run of the three rigs, with each effect
in each of its shapes.
"""

import importlib.util

import pytest

from tests.gap.house.runs import ROOT


def script():
    spec = importlib.util.spec_from_file_location(
        "compile_once", ROOT / "scripts" / "compile_once.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    "rig",
    [pytest.param(rig, marks=[pytest.mark.slow] * (i > 0)) for i, rig in enumerate(script().RIGS)],
)
def test_it_runs_to_its_end(rig):
    made = script()
    made.of_rig(rig, *made.PARTS)
