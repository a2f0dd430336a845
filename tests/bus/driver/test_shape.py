"""What is remembered of a terminal: an answer that is lost once is asked for again."""

import pysoem
import pytest

from drivers.recovery import Shape
from epa_rt.backend import BackendError


class Slave:
    """Answers with zeros, but for the first ``lost`` questions."""

    def __init__(self, lost: int) -> None:
        self.lost = lost

    def _fprd(self, register: int, size: int, timeout_us: int = 2000) -> bytes:
        self.lost -= 1
        if self.lost >= 0:
            raise pysoem.WkcError
        return b"\x01\x01" if size == 2 else bytes(size)


def test_an_answer_that_is_lost_is_asked_for_again():
    Shape(Slave(2), "valves (slave 4, EL4034)")


def test_a_terminal_that_stays_silent_is_named():
    with pytest.raises(BackendError, match=r"valves \(slave 4, EL4034\) does not answer at reg"):
        Shape(Slave(100), "valves (slave 4, EL4034)")
