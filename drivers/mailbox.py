"""Objects of one slave (CoE): read, written and read back, with every refusal in words. Never used
in the cycle.
"""

import struct
from collections.abc import Callable

import pysoem

from drivers.asking import insist
from drivers.words import (
    ABORT_NO_OBJECT,
    ABORT_NO_SUBINDEX,
    abort_words,
    error_class_words,
    error_register_words,
)
from epa_rt.backend import BackendError


class Mailbox:
    """The object dictionary of a slave. ``emergencies`` collects what the slave sends of itself
    while it is polled, as a sentence and its numbers; ``words`` tells its error codes.
    """

    def __init__(
        self, slave: "pysoem.CdefSlave", label: str, words: Callable[[int], str] = error_class_words
    ):
        self.label = label
        self.emergencies: list[tuple[str, dict[str, object]]] = []
        self._words = words
        self._slave = slave
        slave.add_emergency_callback(self._take_emergency)

    def _take_emergency(self, emergency: pysoem.Emergency) -> None:
        code, register = emergency.error_code, emergency.error_reg
        error = self._words(code) if code else "0x0000 errors reset"
        self.emergencies.append(
            (
                f"{self.label}: emergency {error}, error register {error_register_words(register)}",
                {"code": code, "register": register},
            )
        )

    def read(self, index: int, subindex: int = 0) -> bytes:
        """Raises BackendError: which object of which slave, and why not."""
        try:
            return insist(self._slave.sdo_read, index, subindex)
        except Exception as error:
            raise self._refused("read", index, subindex, error) from None

    def number(self, index: int, subindex: int = 0) -> int:
        """An object that holds an unsigned number of any length."""
        return int.from_bytes(self.read(index, subindex), "little")

    def number_if_there(self, index: int, subindex: int = 0) -> int | None:
        """As ``number``; None where the slave does not have the object."""
        try:
            return int.from_bytes(insist(self._slave.sdo_read, index, subindex), "little")
        except pysoem.SdoError as error:
            if error.abort_code & 0xFFFFFFFF in (ABORT_NO_OBJECT, ABORT_NO_SUBINDEX):
                return None
            raise self._refused("read", index, subindex, error) from None
        except Exception as error:
            raise self._refused("read", index, subindex, error) from None

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Writes without reading back, for objects that are in the middle of a change."""
        try:
            insist(self._slave.sdo_write, index, subindex, data)
        except Exception as error:
            raise self._refused(
                f"set to 0x{data[::-1].hex().upper()}", index, subindex, error
            ) from None

    def set(self, index: int, subindex: int, data: bytes) -> None:
        """Writes and reads back. Raises BackendError where it is refused or another value stands
        there afterwards.
        """
        self.write(index, subindex, data)
        self.expect(index, subindex, data)

    def set_if_there(self, index: int, subindex: int, data: bytes) -> bool:
        """As ``set``; False where the slave does not have the object."""
        if self.number_if_there(index, subindex) is None:
            return False
        self.set(index, subindex, data)
        return True

    def steps_to_set(self, index: int, subindex: int, data: bytes) -> list[Callable[[], object]]:
        """``set`` while the others run: each step asks once, and raises pysoem.WkcError where the
        answer stays away.
        """
        return [
            lambda: self._once(
                f"set to 0x{data[::-1].hex().upper()}", self._slave.sdo_write, index, subindex, data
            ),
            lambda: self._compare(
                index, subindex, data, self._once("read", self._slave.sdo_read, index, subindex)
            ),
        ]

    def _once(
        self, what: str, ask: Callable[..., bytes], index: int, subindex: int, *data: bytes
    ) -> bytes:
        try:
            return ask(index, subindex, *data)
        except (pysoem.WkcError, pysoem.PacketError):
            raise pysoem.WkcError from None
        except Exception as error:
            raise self._refused(what, index, subindex, error) from None

    def expect(self, index: int, subindex: int, data: bytes) -> None:
        """Raises BackendError unless the object holds this value."""
        self._compare(index, subindex, data, self.read(index, subindex))

    def _compare(self, index: int, subindex: int, data: bytes, found: bytes) -> None:
        if found[: len(data)] != data or any(found[len(data) :]):
            raise BackendError(
                f"found 0x{found[::-1].hex().upper()} in object 0x{index:04X}:{subindex:02X} of"
                f" {self.label}, expected 0x{data[::-1].hex().upper()}"
            )

    def _refused(self, what: str, index: int, subindex: int, error: Exception) -> BackendError:
        if isinstance(error, pysoem.SdoError):
            why = abort_words(error.abort_code & 0xFFFFFFFF)
        elif isinstance(error, pysoem.MailboxError):
            why = f"mailbox error 0x{error.error_code:04X}"
        elif isinstance(error, pysoem.WkcError):
            why = "no answer from its mailbox"
        else:
            why = f"{type(error).__name__} {error}"
        return BackendError(
            f"object 0x{index:04X}:{subindex:02X} of {self.label} could not be {what}: {why}"
        )


def u8(value: int) -> bytes:
    return struct.pack("<B", value)


def u16(value: int) -> bytes:
    return struct.pack("<H", value)


def u32(value: int) -> bytes:
    return struct.pack("<I", value)
