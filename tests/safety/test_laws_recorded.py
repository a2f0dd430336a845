"""What each law of motion says of rigs that lie, to the step and the word: recorded, because a
change here changes what trips on every rig. Written anew by python -m tests.safety.lying_rig.
"""

import pytest
from lying_rig import NAMES, RECORDED, SEEDS, laws, said
from safety_bench import rig

AT_ONCE = 5
BLOCKS = [(name, first) for name in NAMES for first in range(SEEDS.start, SEEDS.stop, AT_ONCE)]


@pytest.fixture(scope="module")
def recorded() -> dict[str, str]:
    lines = RECORDED.read_text(encoding="utf-8").splitlines()
    return dict(line.split(": ", 1) for line in lines)


@pytest.mark.parametrize(("name", "first"), BLOCKS)
def test_every_law_says_what_was_recorded(name, first, recorded):
    for seed in range(first, first + AT_ONCE):
        for line in said(name, seed):
            key, words = line.split(": ", 1)
            assert words == recorded[key], key


def test_every_law_is_recorded_both_silent_and_refusing(recorded):
    names = {key.split()[2] for key in recorded}
    for law in names:
        words = [text for key, text in recorded.items() if key.split()[2] == law]
        assert "nothing" in words and len(set(words)) > 5, law
    assert len(recorded) == sum(len(laws(rig(name))) for name in NAMES) * len(SEEDS)
