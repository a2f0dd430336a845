"""A command beside an emulated bus, in a network of its own, as an ordinary user: no rights, no
interface needed.

    run_beside(["python", "master.py"], rig="config/rigs/bench.yaml")

The command finds its interface in the environment variable EPA_BUS_INTERFACE, the emulator's
control channel in EPA_BUS_CONTROL, its pace in EPA_BUS_LOCK_STEP (0 or 1). Nothing is left behind:
the network goes with the last process in it.
"""

import ctypes
import functools
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from sim_backend.bus.veth import make_pair

MASTER_END, SLAVE_END = "ecat_master", "ecat_slaves"
INTERFACE, CONTROL, LOCK_STEP = "EPA_BUS_INTERFACE", "EPA_BUS_CONTROL", "EPA_BUS_LOCK_STEP"
_PLAIN = ("unshare", "--net")  # by root: real-time priority, where root has it, is kept
AS_USER = ("unshare", "--user", "--map-root-user", "--net")  # nobody's right to it reaches in here
_ROOT = Path(__file__).parents[2]
_PR_SET_PDEATHSIG = 1
_READY = "ready"


def refusal() -> str | None:
    """Why no network of one's own can be made here; None where it can."""
    return refused(network())


def refused(line: tuple[str, ...]) -> str | None:
    """Why a network cannot be made in this way; None where it can."""
    if shutil.which("unshare") is None:
        return "there is no unshare command"
    tried = subprocess.run([*line, "true"], capture_output=True, text=True)
    return None if tried.returncode == 0 else f"unshare is refused: {tried.stderr.strip()}"


@functools.cache
def network() -> tuple[str, ...]:
    """What makes a network of one's own here."""
    return _PLAIN if os.geteuid() == 0 and refused(_PLAIN) is None else AS_USER


def run_beside(
    command: Sequence[str],
    rig: Path | str,
    serve_arguments: Sequence[str] = (),
    timeout_s: float = 120.0,
    environment: dict[str, str] | None = None,
) -> subprocess.CompletedProcess:
    """Runs a command beside an emulated bus; returns its exit code and output. ``serve_arguments``
    as for `epa bus serve` (--lock-step, --seed N, --plant P, --control SOCKET). Raises
    subprocess.TimeoutExpired.
    """
    return run_line(command_beside(command, rig, serve_arguments), timeout_s, environment)


def run_line(
    line: Sequence[str], timeout_s: float, environment: dict[str, str] | None = None
) -> subprocess.CompletedProcess:
    """Runs a command line in a session of its own, all of which is killed where it takes too long.
    Raises subprocess.TimeoutExpired.
    """
    process = subprocess.Popen(
        line,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **(environment or {})},
        start_new_session=True,
    )
    try:
        out, errors = process.communicate(timeout=timeout_s)
    except BaseException:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        raise
    return subprocess.CompletedProcess(process.args, process.returncode, out, errors)


def command_beside(
    command: Sequence[str], rig: Path | str, serve_arguments: Sequence[str] = ()
) -> list[str]:
    """The whole command line of ``run_beside``, for who wants to start it otherwise."""
    return [
        *network(),
        sys.executable,
        "-c",
        (
            f"import sys; sys.path.insert(0, {str(_ROOT)!r}); "
            "from sim_backend.bus.namespace import inside; sys.exit(inside(sys.argv[1:]))"
        ),
        str(rig),
        *serve_arguments,
        "--",
        *command,
    ]


def inside(arguments: Sequence[str]) -> int:
    """Runs in the new network: the pair of interfaces, the emulator on one, the command on the
    other.
    """
    arguments = list(arguments)
    cut = arguments.index("--")
    rig, options, command = arguments[0], arguments[1:cut], arguments[cut + 1 :]
    make_pair(MASTER_END, SLAVE_END)
    with tempfile.TemporaryDirectory(prefix="epa_bus_") as folder:
        if "--control" not in options:
            options += ["--control", str(Path(folder, "control"))]
        control = options[options.index("--control") + 1]
        environment = {**os.environ, INTERFACE: MASTER_END, CONTROL: control}
        environment[LOCK_STEP] = str(int("--lock-step" in options))
        environment["PYTHONPATH"] = os.pathsep.join(
            filter(None, (str(_ROOT), os.environ.get("PYTHONPATH")))
        )
        emulator = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "epa_rt",
                "bus",
                "serve",
                "--rig",
                rig,
                "--interface",
                SLAVE_END,
                *options,
            ],
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
            preexec_fn=die_with_parent,
            start_new_session=True,  # a rig has no Ctrl-C
        )
        try:
            if not _is_ready(emulator):
                return emulator.wait()
            return run_to_its_end(command, environment)
        except KeyboardInterrupt:  # before the command began
            return 128 + signal.SIGINT
        finally:
            emulator.terminate()
            try:
                emulator.wait(10.0)
            except subprocess.TimeoutExpired:
                emulator.kill()
                emulator.wait()
            emulator.stdout.close()


def run_to_its_end(command: Sequence[str], environment: dict[str, str] | None = None) -> int:
    """Runs a command, and leaves Ctrl-C to it: a terminal sends it to the command as well, which
    brings its rig to rest in its own time. Returns its exit code.
    """
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with subprocess.Popen(command, env=environment, preexec_fn=_heed_interrupts) as process:
            code = process.wait()
    finally:
        signal.signal(signal.SIGINT, before)
    return code if code >= 0 else 128 - code


def _heed_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    die_with_parent()


def _is_ready(emulator: subprocess.Popen) -> bool:
    return any(line.startswith(_READY) for line in emulator.stdout)


def die_with_parent() -> None:
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
