"""How the network card of the bus is set: driver, link, what it holds back, who serves its
interrupts. Read-only.

Sources: ethtool(8), Linux /proc/interrupts and /proc/irq, SOEM issue threads on interrupt
coalescing.
"""

import re
import shutil
import subprocess
from pathlib import Path

from drivers.host import BAD, BETTER, OK, UNSEEN, Finding, cores_of, text_of
from drivers.interface import Interface, candidates, interfaces
from epa_rt.backend import BackendError

_NET = Path("/sys/class/net")


def card_findings(name: str | None, core: int | None) -> list[Finding]:
    """``name``: the interface (None: the only candidate). Raises BackendError where there is no
    such interface.
    """
    present = interfaces()
    shown = ", ".join(f"{i.name} ({i.state})" for i in present) or "none"
    if name is None:
        possible = candidates(present)
        if len(possible) != 1:
            return [
                Finding(
                    "network interface",
                    UNSEEN,
                    f"{len(possible)} candidates",
                    f"--interface says which; there are: {shown}",
                )
            ]
        chosen = possible[0]
    else:
        named = next((i for i in present if i.name == name), None)
        if named is None:
            raise BackendError(f"found no network interface '{name}', expected one of: {shown}")
        chosen = named
    return [
        _link(chosen),
        _driver(chosen),
        _other_traffic(chosen),
        _offloads(chosen),
        _coalescing(chosen),
        _interrupts(chosen, core),
        _balancer(),
    ]


def _link(card: Interface) -> Finding:
    if not card.is_up:
        return Finding(
            "link",
            BAD,
            f"{card.name} is switched off",
            "no frame leaves",
            f"sudo ip link set {card.name} up",
        )
    if not card.has_link:
        return Finding(
            "link",
            BAD,
            f"{card.name} has no link",
            "no frame leaves",
            "power the bus coupler and plug its cable in",
        )
    speed = text_of(_NET / card.name / "speed")
    return Finding(
        "link",
        OK,
        f"{card.name} has a link" + (f" at {speed} Mbit/s" if speed and speed.isdigit() else ""),
    )


def _driver(card: Interface) -> Finding:
    link = _NET / card.name / "device/driver"
    told = re.search(r"^driver: (\S+)", _ethtool("-i", card.name) or "", re.MULTILINE)
    driver = link.resolve().name if link.exists() else told[1] if told else ""
    why = (
        "cards of their own on PCI Express answer in microseconds; a USB adapter holds frames back"
        " for 125 us or more"
    )
    if not driver:
        return Finding("card", UNSEEN, "its driver does not show here", why)
    usb = "usb" in str((_NET / card.name / "device").resolve())
    return Finding(
        "card",
        BETTER if usb or card.is_wireless else OK,
        driver + (" on USB" if usb else ""),
        why,
        "use a card on PCI Express" if usb else "",
    )


def _other_traffic(card: Interface) -> Finding:
    addresses = _run("ip", "-brief", "address", "show", card.name)
    if addresses is None:
        return Finding("other traffic", UNSEEN, "the command ip is missing")
    has_address = len(addresses.split()) > 2
    return Finding(
        "other traffic",
        BETTER if has_address else OK,
        "the interface has an address" if has_address else "no address",
        "other frames on the wire delay the bus's",
        f"sudo nmcli device set {card.name} managed no; sudo ip address flush dev {card.name}; sudo"
        f" sysctl -w net.ipv6.conf.{card.name}.disable_ipv6=1; sudo ip link set {card.name}"
        " arp off",
    )


def _offloads(card: Interface) -> Finding:
    text = _ethtool("-k", card.name)
    if text is None:
        return Finding(
            "offloads", UNSEEN, "ethtool is missing or may not ask", "", "sudo apt install ethtool"
        )
    on = [
        short
        for long, short in (("generic-receive-offload", "gro"), ("large-receive-offload", "lro"))
        if re.search(rf"^{long}: on(?! \[fixed\])", text, re.MULTILINE)
    ]
    return Finding(
        "offloads",
        BETTER if on else OK,
        f"{', '.join(on)} on" if on else "none that holds frames back",
        "gathering frames before handing them over costs time",
        f"sudo ethtool -K {card.name} {' '.join(o + ' off' for o in on)}",
    )


def _coalescing(card: Interface) -> Finding:
    text = _ethtool("-c", card.name)
    if text is None:
        return Finding("interrupt coalescing", UNSEEN, "the card or its driver does not tell it")
    held = {
        k: int(v)
        for k, v in re.findall(r"^(rx-usecs|tx-usecs|rx-frames): (\d+)", text, re.MULTILINE)
    }
    slow = held.get("rx-usecs", 0) > 1 or re.search(r"Adaptive RX: on", text) is not None
    return Finding(
        "interrupt coalescing",
        BETTER if slow else OK,
        ", ".join(f"{k} {v}" for k, v in held.items()) or "none",
        "a card that waits for more frames before it interrupts delays every cycle",
        f"sudo ethtool -C {card.name} adaptive-rx off rx-usecs 0 tx-usecs 0 rx-frames 1",
    )


def _interrupts(card: Interface, core: int | None) -> Finding:
    numbers = re.findall(
        rf"^\s*(\d+):.*\b{re.escape(card.name)}\b", text_of("/proc/interrupts") or "", re.MULTILINE
    )
    why = "an interrupt served on a busy core waits; best on the loop's own core or its neighbour"
    if not numbers:
        return Finding("interrupts", UNSEEN, "this interface has none of its own", why)
    served = {n: text_of(f"/proc/irq/{n}/smp_affinity_list") or "?" for n in numbers}
    pinned = all(len(cores_of(cores)) == 1 for cores in served.values() if cores != "?")
    wanted = core if core is not None else 0
    return Finding(
        "interrupts",
        OK if pinned else BETTER,
        ", ".join(f"{n} on cores {c}" for n, c in served.items()),
        why,
        "; ".join(f"echo {wanted} | sudo tee /proc/irq/{n}/smp_affinity_list" for n in numbers),
    )


def _balancer() -> Finding:
    running = any((text_of(p) or "") == "irqbalance" for p in Path("/proc").glob("[0-9]*/comm"))
    return Finding(
        "interrupt balancer",
        BETTER if running else OK,
        "irqbalance runs" if running else "none runs",
        "it moves the card's interrupt to other cores",
        "sudo systemctl disable --now irqbalance",
    )


def _ethtool(option: str, name: str) -> str | None:
    return _run("ethtool", option, name)


def _run(*command: str) -> str | None:
    """A command's output; None where it is missing or fails. Nothing here changes anything."""
    path = shutil.which(command[0], path="/usr/sbin:/sbin:/usr/bin:/bin")
    if path is None:
        return None
    try:
        done = subprocess.run(
            [path, *command[1:]], capture_output=True, text=True, timeout=5, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout if done.returncode == 0 else None
