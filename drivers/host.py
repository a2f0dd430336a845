"""What this machine grants a real-time loop: rights, kernel, clock, cores. Read-only; works for any
user.

Sources: capabilities(7), sched(7), Linux kernel-parameters, PREEMPT_RT documentation.
"""

import gzip
import os
import platform
import re
import resource
from pathlib import Path
from typing import NamedTuple

from drivers.interface import RIGHTS_COMMAND, check_rights
from epa_rt.backend import BackendError

OK, BETTER, BAD, UNSEEN = "ok", "could be better", "in the way", "not seen"
_CAP_IPC_LOCK, _CAP_SYS_NICE = 14, 23
_CPU = Path("/sys/devices/system/cpu")


class Finding(NamedTuple):
    """One thing looked at: how it stands, why it matters, the command that changes it."""

    name: str
    status: str
    found: str
    why: str = ""
    command: str = ""


def host_findings(priority: int, core: int | None) -> list[Finding]:
    """``priority`` and ``core``: what the rig's loop asks for."""
    return [
        _raw_socket(),
        _priority(priority),
        _memory(),
        _preemption(),
        _ticks(),
        _throttling(),
        *_isolation(core),
        _governor(),
        _sleep_states(),
        _clock_source(),
        _cores(core),
        _share(),
        _stolen(),
    ]


def text_of(path: Path | str) -> str | None:
    """A file's text without the line end; None where it cannot be read."""
    try:
        return Path(path).read_text(encoding="ascii", errors="replace").strip()
    except OSError:
        return None


def _has_capability(bit: int) -> bool:
    match = re.search(r"^CapEff:\s*([0-9a-f]+)", text_of("/proc/self/status") or "", re.MULTILINE)
    return bool(match and int(match[1], 16) >> bit & 1)


def _raw_socket() -> Finding:
    why = "EtherCAT frames leave through a raw socket"
    try:
        check_rights()
    except BackendError:
        return Finding("raw socket", BAD, "not allowed", why, RIGHTS_COMMAND)
    return Finding("raw socket", OK, "allowed", why)


def _priority(wanted: int) -> Finding:
    limit = resource.getrlimit(resource.RLIMIT_RTPRIO)[0]
    allowed = 99 if _has_capability(_CAP_SYS_NICE) or limit == resource.RLIM_INFINITY else limit
    why = "the loop must not wait for other programs"
    command = (
        "sudo groupadd -f epa && sudo usermod -aG epa $USER && echo '@epa - rtprio 98' | "
        "sudo tee -a /etc/security/limits.d/epa.conf  (log in again)"
    )
    return Finding(
        "real-time priority",
        OK if allowed >= wanted else BETTER,
        f"up to {allowed}, {wanted} wanted",
        why,
        command,
    )


def _memory() -> Finding:
    limit = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0]
    free = limit == resource.RLIM_INFINITY or _has_capability(_CAP_IPC_LOCK)
    return Finding(
        "locked memory",
        OK if free else BETTER,
        "unlimited" if free else f"{limit >> 20} MB",
        "a page fault in the cycle is a late cycle",
        "echo '@epa - memlock unlimited' | sudo tee -a /etc/security/limits.d/epa.conf  (log in"
        " again)",
    )


def _preemption() -> Finding:
    version = platform.version()
    is_rt = text_of("/sys/kernel/realtime") == "1" or "PREEMPT_RT" in version
    kind = (
        "PREEMPT_RT"
        if is_rt
        else next((w for w in ("PREEMPT_DYNAMIC", "PREEMPT") if w in version), "no preemption")
    )
    return Finding(
        "kernel",
        OK if is_rt else BETTER,
        f"{platform.release()}, {kind}",
        "without PREEMPT_RT a driver or the network stack can hold the loop up for milliseconds",
        "sudo apt install linux-image-rt-amd64  (Debian; then reboot)",
    )


def _ticks() -> Finding:
    config = text_of(f"/boot/config-{platform.release()}")
    if config is None:
        try:
            config = gzip.decompress(Path("/proc/config.gz").read_bytes()).decode(
                "ascii", "replace"
            )
        except OSError:
            return Finding("kernel ticks", UNSEEN, "no kernel configuration to read")
    match = re.search(r"^CONFIG_HZ=(\d+)", config, re.MULTILINE)
    hertz = int(match[1]) if match else 0
    return Finding(
        "kernel ticks",
        OK if hertz >= 1000 else BETTER,
        f"HZ={hertz}",
        "some waits in SOEM (start-up, states) end on a tick; the cycle's own do not",
        "a kernel built with CONFIG_HZ_1000=y",
    )


def _throttling() -> Finding:
    runtime = text_of("/proc/sys/kernel/sched_rt_runtime_us")
    if runtime is None:
        return Finding("real-time throttling", UNSEEN, "not readable")
    return Finding(
        "real-time throttling",
        OK if runtime == "-1" else BETTER,
        "off" if runtime == "-1" else f"{runtime} us of each second",
        "a real-time program that computes for 0.95 s is stopped for 0.05 s; the loop sleeps, so it"
        " matters only beside others",
        "sudo sysctl -w kernel.sched_rt_runtime_us=-1",
    )


def _isolation(core: int | None) -> list[Finding]:
    isolated = text_of(_CPU / "isolated")
    wanted = core if core is not None else max(os.sched_getaffinity(0))
    why = "other programs and interrupts stay off the loop's core"
    command = (
        f"add 'isolcpus=managed_irq,domain,{wanted} nohz_full={wanted} rcu_nocbs={wanted}' to"
        " GRUB_CMDLINE_LINUX in /etc/default/grub, sudo update-grub, reboot; and 'realtime:"
        f" {{core: {wanted}}}' in the rig file"
    )
    if isolated is None:
        return [Finding("isolated cores", UNSEEN, "not readable", why)]
    held = core is not None and core in cores_of(isolated)
    return [Finding("isolated cores", OK if held else BETTER, isolated or "none", why, command)]


def cores_of(text: str) -> set[int]:
    """{0, 2, 3} for '0,2-3'."""
    cores: set[int] = set()
    for part in filter(None, text.split(",")):
        first, _, last = part.partition("-")
        cores.update(range(int(first), int(last or first) + 1))
    return cores


def _governor() -> Finding:
    told = [text_of(p) for p in _CPU.glob("cpu[0-9]*/cpufreq/scaling_governor")]
    found = {text for text in told if text is not None}
    if not found:
        return Finding("frequency governor", UNSEEN, "this kernel does not set core frequencies")
    return Finding(
        "frequency governor",
        OK if found == {"performance"} else BETTER,
        ", ".join(sorted(found)),
        "a core that has clocked down wakes late",
        "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor",
    )


def _sleep_states() -> Finding:
    latencies = [int(text_of(p) or 0) for p in _CPU.glob("cpu0/cpuidle/state*/latency")]
    if not latencies:
        return Finding("core sleep states", UNSEEN, "this kernel shows none")
    deepest = max(latencies)
    return Finding(
        "core sleep states",
        OK if deepest <= 20 else BETTER,
        f"waking takes up to {deepest} us",
        "a core in deep sleep wakes late",
        "sudo cpupower idle-set -D 20",
    )


def _clock_source() -> Finding:
    found = text_of("/sys/devices/system/clocksource/clocksource0/current_clocksource")
    if found is None:
        return Finding("clock source", UNSEEN, "not readable")
    good = found in ("tsc", "arch_sys_counter", "kvm-clock")
    return Finding(
        "clock source",
        OK if good else BETTER,
        found,
        "each cycle reads the clock several times; hpet and acpi_pm take microseconds",
        "echo tsc | sudo tee /sys/devices/system/clocksource/clocksource0/current_clocksource",
    )


def _cores(core: int | None) -> Finding:
    ours = os.sched_getaffinity(0)
    found = f"{len(ours)} of {os.cpu_count()} usable" + (
        f", the rig asks for core {core}" if core is not None else ""
    )
    if core is not None and core not in ours:
        return Finding(
            "cores",
            BETTER,
            found,
            "the loop cannot run on the core that it asks for",
            f"taskset -c {core} epa run ...",
        )
    return Finding(
        "cores",
        OK if len(ours) >= 2 else BETTER,
        found,
        "loop and recorder want a core each",
        "a machine with two cores or more",
    )


def _share() -> Finding:
    limit = text_of("/sys/fs/cgroup/cpu.max")
    if limit is None:
        return Finding("share of the cores", OK, "no limit of this process's group seen")
    free = limit.startswith("max")
    return Finding(
        "share of the cores",
        OK if free else BETTER,
        "no limit" if free else f"cpu.max {limit}",
        "a group that has used up its share is stopped until the next period",
        "run outside the container, or give it cpu.max 'max'",
    )


def _stolen() -> Finding:
    match = re.search(r"^cpu\s+(.*)$", text_of("/proc/stat") or "", re.MULTILINE)
    numbers = [int(n) for n in match[1].split()] if match else []
    if len(numbers) < 8 or not sum(numbers[:8]):
        return Finding("time given to other machines", UNSEEN, "not readable")
    share = numbers[7] / sum(numbers[:8])
    return Finding(
        "time given to other machines",
        OK if share < 1e-4 else BETTER,
        f"{share:.2%} since start",
        "a virtual machine's cores are not its own",
        "run on a real machine, or pin the virtual one's cores",
    )
