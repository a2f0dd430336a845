"""Lock step is for emulated buses: a wire with a card behind it is refused, also where nobody named
it.
"""

import fcntl
import socket
import struct
import tempfile
from pathlib import Path

import pytest

from drivers.interface import choose, reaches_a_card
from epa_rt.backend import BackendError
from sim_backend.bus.veth import make_pair, remove
from tests.bus.own_network import call

NEAR, FAR = "ve0", "ve1"
SET_FLAGS = 0x8914  # linux/sockios.h


def made_up(root: Path) -> Path:
    """A sysfs with a card, a veth, and what stands on a card: a VLAN, and a bridge over that."""
    for name in ("eth1", "ve0", "eth1.5", "br0"):
        (root / name).mkdir(parents=True)
    (root / "eth1/device").mkdir()
    (root / "eth1.5/lower_eth1").symlink_to(root / "eth1")
    (root / "br0/lower_eth1.5").symlink_to(root / "eth1.5")
    return root


def test_a_card_is_what_has_a_device_at_or_below_it(tmp_path):
    net = made_up(tmp_path)
    assert {
        name: reaches_a_card(name, net) for name in ("eth1", "eth1.5", "br0", "ve0", "elsewhere")
    } == {"eth1": True, "eth1.5": True, "br0": True, "ve0": False, "elsewhere": False}


@pytest.mark.network
def test_lock_step_on_a_card_is_refused_whether_it_is_named_or_found():
    said = call("tests.bus.test_lock_step_wire:of_a_pair")
    sentence = f"found lock step on {NEAR}, which leads to a real wire, expected an emulated bus"
    assert said["named"]["card"].startswith(sentence) and "\n" not in said["named"]["card"]
    assert said["named"]["veth"] == said["named"]["card, paced"] == NEAR
    assert said["found"]["card"].startswith(sentence)
    assert not any(
        "lock step" in said["found"][other] for other in ("veth", "card, paced")
    )  # nor a link, once the kernel has seen that its peer is down


def of_a_pair() -> dict:
    """In the network: what ``choose`` says of a veth's end by its name, and then of the only end
    that is up, beside a made-up sysfs that gives it a device, or none.
    """

    def said(wanted: str | None) -> dict:
        return {
            "card": one(wanted, True, card),
            "veth": one(wanted, True, veth),
            "card, paced": one(wanted, False, card),
        }

    def one(*arguments: object) -> str:
        try:
            return choose(*arguments)
        except BackendError as error:
            return str(error)

    make_pair(NEAR, FAR)
    try:
        with tempfile.TemporaryDirectory() as folder:
            card, veth = Path(folder, "card"), Path(folder, "veth")
            (card / NEAR / "device").mkdir(parents=True)
            (veth / NEAR).mkdir(parents=True)
            named = said(NEAR)
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
                fcntl.ioctl(asking, SET_FLAGS, struct.pack("16sh22x", FAR.encode(), 0))  # down
            return {"named": named, "found": said(None)}
    finally:
        remove(NEAR)
