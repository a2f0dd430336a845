"""epa: run experiments on an electric-pneumatic actuator, simulated or real, and read what came
out.

first hour:
  epa check config/rigs/bench.yaml                      is the rig file sound?
  epa run config/experiments/identification_short.yaml --rig config/rigs/bench.yaml --dry
                                                        what would move, and how far?
  epa run config/experiments/identification_short.yaml --rig config/rigs/bench.yaml -o out
                                                        run it on the simulated rig
  epa report out/identification_short-bench-001.mcap    one page to read
  epa replay out/*.mcap                                 same inputs, same bytes?
  epa gap diagnose --rig config/rigs/bench.yaml out/*.mcap
                                                        why do rig and simulation disagree?
  epa identify out/*.mcap --rig config/rigs/bench.yaml -o muscle.yaml --html muscle.html
                                                        which force law, with which numbers?
"""

import errno
import importlib
import io
import os
import sys
from collections.abc import Sequence

from epa_rt.cli.early import release_interrupts
from epa_rt.cli.exits import BAD_INPUT, EPILOGUE, FAILED, STOPPED, VerbError
from epa_rt.cli.outputs import answer_alone
from epa_rt.cli.parser import EpaParser, summary
from epa_rt.cli.screen_text import filled
from epa_rt.cli.version import ShowVersion

VERBS = (
    "check",
    "run",
    "queue",
    "live",
    "home",
    "jog",
    "calibrate",
    "tune",
    "bus",
    "replay",
    "info",
    "ls",
    "compare",
    "export",
    "plot",
    "report",
    "gap",
    "identify",
    "study",
    "import",
    "schema",
    "scan",
    "doctor",
    "completion",
    "init",
)
_REFUSED = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)  # by what the output goes to
# links and logs go side by side; threads inside their small products would spin on the same
# processors (docs/decisions/0015)
_ONE_THREAD = "OPENBLAS_NUM_THREADS"
_FILES = {"import": "import_"}  # verbs that Python has another use for


def parser() -> EpaParser:
    """The whole command line. Verb modules only import heavy libraries once they run."""
    top = EpaParser(prog="epa", description=__doc__, epilog=EPILOGUE)
    top.add_argument("--version", action=ShowVersion, help="version and state of the code")
    verbs = top.add_subparsers(dest="verb", metavar="VERB", required=True)
    for name in VERBS:
        module = importlib.import_module(f"epa_rt.cli.{_FILES.get(name, name)}")
        verb = verbs.add_parser(
            name, help=summary(module.__doc__), description=module.__doc__, epilog=EPILOGUE
        )
        module.add_arguments(verb)
        verb.set_defaults(main=module.main)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one verb; returns its exit code. Errors of the operator's input come out as one
    sentence.
    """
    os.environ.setdefault(_ONE_THREAD, "1")  # before anything imports numpy
    from epa_rt.config.source import ConfigError

    _spare_the_terminal()
    try:
        everything = parser()
    except KeyboardInterrupt:  # while the verbs are loaded
        print("epa: interrupted", file=sys.stderr)
        return STOPPED
    if "_ARGCOMPLETE" in os.environ:  # a shell asks what may follow
        import argcomplete

        argcomplete.autocomplete(everything)
    chosen = everything.parse_args(arguments)
    try:
        release_interrupts()
        with answer_alone(vars(chosen).get("json")):
            code = chosen.main(chosen)
        sys.stdout.flush()  # what a full disk refuses shows here and not as the interpreter ends
        return code
    except VerbError as error:
        _say(f"{chosen.program}: {error}")
        return error.code
    except ConfigError as error:
        for one in error.errors:
            _say(f"{chosen.program}: {one}")
        return BAD_INPUT
    except KeyboardInterrupt:
        print(f"{chosen.program}: interrupted", file=sys.stderr)
        return STOPPED
    except BrokenPipeError:
        _discard_the_rest()
        return 0
    except OSError as error:
        if (
            error.filename is not None
        ):  # a folder that may not be entered, a name too long: whichever question met it first
            _say(f"{chosen.program}: {error.filename}: {_trouble(error)}")
            return BAD_INPUT
        if error.errno not in _REFUSED:
            raise
        _discard_the_rest()
        print(
            f"{chosen.program}: what it says cannot be written ({error.strerror})", file=sys.stderr
        )
        return FAILED


def _spare_the_terminal() -> None:
    """A terminal without a character must not end a run's report."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _trouble(error: OSError) -> str:
    """What is wrong with the file or folder of an error, in words."""
    if error.errno == errno.ENOENT:
        return "found no such file or folder, expected one that is there"
    return f"cannot be read or written ({error.strerror})"


def _say(sentence: str) -> None:
    print(filled(sentence, sys.stderr), file=sys.stderr)


def _discard_the_rest() -> None:
    """What is left of the output goes nowhere, so that the interpreter's last flush does not fail
    as well.
    """
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


if __name__ == "__main__":
    sys.exit(main())
