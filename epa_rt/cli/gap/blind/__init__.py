"""Judge the diagnosis on cases whose truth is sealed: make them, score them, cross every effect out
in turn.

  epa gap blind make --seed 7 --cases 120 -o out/blind
                        logs there, truth sealed in out/blind.sealed
  epa gap blind make --seed 7 --each 20 -o out/each
                        every hidden effect alone, strong: a set to develop on
  epa gap blind again out/blind
                        the logs of a sealed set that was sent without them
  epa gap blind score out/blind --json blind.json
                        diagnoses every case, then opens the truth
  epa gap blind score out/blind --json blind.json --next
                        where effects cannot be told apart, runs the proposed experiment too
  epa gap blind oracle out/blind --json oracle.json
                        what the data allow: told the laws, it only fits them (run it last);
                        --answers blind.answers --missed: of what was missed;
                        --next: of the proposed experiments
  epa gap blind matrix --seed 7 -o out/matrix
                        each effect hidden and left out: what is said instead
  epa gap blind pool blind.json other.json
                        shares over the cases of several sets
  epa gap blind compare one.json other.json
                        two diagnosers on one set: log and Brier score, sign test, reliability
  epa gap blind rivals out/blind --json rivals.json --beside blind.json
                        the same cases by CMA-ES, least squares, sparse regression, RMSE
"""

import argparse
import signal
import sys
from pathlib import Path

from epa_rt.cli.exits import BAD_INPUT, COMPLETED, VerbError
from epa_rt.cli.gap.blind.cases import check_cases
from epa_rt.cli.gap.blind.places import (
    alone,
    check_answers,
    check_folder,
    check_new,
    check_sealed,
    sealed_of,
)
from epa_rt.cli.gap.blind.rivals import RIVALS, beside_libraries, check_libraries
from epa_rt.cli.gap.inputs import task_parser
from epa_rt.cli.write import check_writable

CASES = 120
OUT = "folder of the cases: new, or one that was interrupted"
DIAGNOSER = "epa_rt.cli.gap.blind.diagnose:diagnose_files"


def add_parser(tasks: "argparse._SubParsersAction") -> None:
    parts = task_parser(tasks, "blind", __doc__).add_subparsers(
        dest="part", metavar="PART", required=True
    )
    make = parts.add_parser("make", help="record cases and seal their truth")
    make.add_argument(
        "--seed",
        type=int,
        required=True,
        help="another seed gives other cases; it is sealed with the truth",
    )
    make.add_argument("--cases", type=_count, help=f"how many (default: {CASES})")
    make.add_argument("--kinds", nargs="+", help="only these kinds of cases")
    make.add_argument(
        "--each",
        type=_limits,
        metavar="LIMITS",
        help=(
            "instead: every hidden effect that has a name, alone, on every rig that shows it, so"
            " many times its detection limit"
        ),
    )
    make.add_argument(
        "--laws",
        type=int,
        choices=tuple(range(1, 7)),
        default=6,
        help=(
            "hidden formulas: 1 as in sets up to the tenth, 2 with other ones where the catalogue"
            " has come near these, 3 to 6 with others again where it has caught up (default:"
            " %(default)s)"
        ),
    )
    make.add_argument(
        "--short",
        action="store_true",
        help="trials of a quarter of the length: to see that all of it runs, not to judge by",
    )
    make.add_argument("-o", "--out", type=Path, required=True, help=OUT)
    make.add_argument(
        "--sealed", type=Path, help="folder of the sealed truth (default: OUT.sealed)"
    )
    again = parts.add_parser("again", help="record the logs of a sealed set that lacks them")
    again.add_argument("cases", type=Path, metavar="DIR", help="where its truth.sha256 lies")
    score = parts.add_parser("score", help="diagnose every case, then open the truth")
    score.add_argument("cases", type=Path, metavar="DIR", help="what epa gap blind make wrote")
    score.add_argument(
        "--json", type=Path, required=True, help="all figures and what was said of every case"
    )
    score.add_argument("--html", type=Path, help="confusion picture (default: beside the JSON)")
    score.add_argument(
        "--next",
        action="store_true",
        help="run the proposed next experiments on the hidden rig and diagnose again",
    )
    oracle = parts.add_parser(
        "oracle",
        help=(
            "what the data allow: a diagnoser that is told the laws and only fits them; its answers"
            " tell the truth"
        ),
    )
    oracle.add_argument("cases", type=Path, metavar="DIR", help="what epa gap blind make wrote")
    oracle.add_argument(
        "--json", type=Path, required=True, help="figures and every law's chi-square"
    )
    oracle.add_argument(
        "--answers",
        type=Path,
        metavar="DIR",
        help=(
            "a diagnosis' answers (beside the JSON of score): what it named wrongly is a rival too"
        ),
    )
    some = oracle.add_mutually_exclusive_group()
    some.add_argument(
        "--missed", action="store_true", help="only cases that those answers get wrong"
    )
    some.add_argument(
        "--next",
        action="store_true",
        help=(
            "what the proposed next experiments tell, recorded by score --next, whose --answers are"
            " asked for"
        ),
    )
    matrix = parts.add_parser(
        "matrix", help="each effect hidden and left out of the catalogue: what is said instead"
    )
    matrix.add_argument("--seed", type=int, required=True, help="another seed gives other cases")
    matrix.add_argument("-o", "--out", type=Path, required=True, help=OUT)
    matrix.add_argument(
        "--of",
        choices=("stand_in", "catalogue"),
        default="stand_in",
        help=(
            "stand_in: every hidden effect, by the stand-in's formulas; catalogue: those it has"
            " none for, by the catalogue's own law"
        ),
    )
    rivals = parts.add_parser("rivals", help="the same cases by what libraries offer")
    rivals.add_argument("cases", type=Path, metavar="DIR", help="what epa gap blind make wrote")
    rivals.add_argument(
        "--json",
        type=Path,
        required=True,
        help="figures of every rival; its answers are kept beside",
    )
    rivals.add_argument(
        "--only",
        metavar="RIVAL",
        nargs="+",
        default=list(RIVALS),
        choices=RIVALS,
        help=f"of {', '.join(RIVALS)} (default: all)",
    )
    rivals.add_argument(
        "--first",
        type=_count,
        metavar="N",
        help="the first N cases alone (kinds are mixed): rivals take their time",
    )
    rivals.add_argument(
        "--beside",
        type=Path,
        metavar="JSON",
        help="what score wrote for the same cases: a row of its own in the table",
    )
    pool = parts.add_parser("pool", help="figures of several scored sets as one")
    pool.add_argument(
        "sets", type=Path, nargs="+", metavar="JSON", help="what score wrote for each set"
    )
    pair = parts.add_parser("compare", help="two diagnosers on the same set, side by side")
    pair.add_argument(
        "sets", type=Path, nargs=2, metavar="JSON", help="what score wrote for the same cases"
    )
    for part in (score, matrix):
        part.add_argument("--diagnoser", default=DIAGNOSER, help=argparse.SUPPRESS)
    for part in (again, score, rivals, oracle):
        part.add_argument(
            "--sealed", type=Path, help="folder of the sealed truth (default: DIR.sealed)"
        )
    for part in (make, again, score, matrix, rivals, oracle):
        part.add_argument(
            "--jobs", type=_count, default=2, help="processes at once (default: %(default)s)"
        )
        part.add_argument(
            "--config",
            type=Path,
            default=Path("config"),
            help="folder with rigs and plants (default: %(default)s)",
        )


def _count(text: str) -> int:
    """A whole number of one or more. Raises ArgumentTypeError."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"found {text}, expected a whole number, 1 or more")
    return int(text)


def _limits(text: str) -> float:
    """A strength in detection limits, 0.5 to 200. Raises ArgumentTypeError."""
    try:
        limits = float(text)
    except ValueError:
        limits = 0.0
    if not 0.5 <= limits <= 200.0:
        raise argparse.ArgumentTypeError(
            f"found {text}, expected a number of detection limits, 0.5 to 200"
        )
    return limits


def run(arguments: argparse.Namespace) -> int:
    from epa_rt.benchmark.seal import SealError

    check_writable(getattr(arguments, "json", None), (".json",))  # before hours of work
    check_writable(getattr(arguments, "html", None), (".html", ".htm"))
    if arguments.part in ("make", "again", "matrix") and not (arguments.config / "rigs").is_dir():
        raise VerbError(
            f"{arguments.config}: found no folder rigs in it, expected the folder with rigs and"
            " plants (--config)"
        )
    if arguments.part == "pool":
        from epa_rt.cli.gap.blind.pool import pool

        print(pool(arguments.sets))
        return COMPLETED
    if arguments.part == "compare":
        from epa_rt.cli.gap.blind.compare import compare

        print(compare(arguments.sets))
        return COMPLETED
    if arguments.part == "oracle":
        check_answers(
            arguments.answers,
            "--missed" if arguments.missed else "--next" if arguments.next else None,
        )
    try:
        if arguments.part in ("again", "score", "rivals", "oracle"):
            check_sealed(arguments.cases, sealed_of(arguments.cases, arguments.sealed))
        if arguments.part in ("score", "rivals", "oracle"):
            check_cases(arguments.cases)
        if arguments.part == "rivals":
            check_libraries(arguments.only)
        part = {
            "make": _make,
            "again": _again,
            "score": _score,
            "matrix": _matrix,
            "rivals": _rivals,
            "oracle": _oracle,
        }[arguments.part]
        before = signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends its workers too
        try:
            return part(arguments)
        finally:
            signal.signal(signal.SIGTERM, before)
    except SealError as error:
        raise VerbError(str(error), BAD_INPUT) from None


def _again(arguments: argparse.Namespace) -> int:
    from epa_rt.cli.gap.blind.make import record_again

    sealed = sealed_of(arguments.cases, arguments.sealed)
    record_again(arguments.cases, sealed, arguments.config, arguments.jobs)
    return COMPLETED


def _make(arguments: argparse.Namespace) -> int:
    check_folder(arguments.out)
    from epa_rt.cli.gap.blind.make import make_all, make_each
    from sim_backend.stand_in.draw import KINDS

    unknown = [kind for kind in arguments.kinds or () if kind not in KINDS]
    if unknown:
        raise VerbError(f"--kinds: found {', '.join(unknown)}, expected some of {', '.join(KINDS)}")
    sealed = sealed_of(arguments.out, arguments.sealed)
    check_new(arguments.out, sealed)
    if arguments.each and (arguments.cases or arguments.kinds):
        raise VerbError(
            f"--each: found {'--cases' if arguments.cases else '--kinds'} beside it, expected it"
            " alone (it has as many cases as there are effects and rigs)"
        )
    with alone(arguments.out):
        check_new(arguments.out, sealed)  # another may just have ended
        if arguments.each:
            make_each(
                arguments.seed,
                arguments.each,
                arguments.out,
                sealed,
                arguments.config,
                arguments.jobs,
                arguments.laws,
            )
        else:
            make_all(
                arguments.seed,
                arguments.cases or CASES,
                tuple(arguments.kinds or KINDS),
                arguments.out,
                sealed,
                arguments.config,
                arguments.jobs,
                arguments.laws,
                arguments.short,
            )
    return COMPLETED


def _score(arguments: argparse.Namespace) -> int:
    from epa_rt.benchmark.score import score

    sealed, again = sealed_of(arguments.cases, arguments.sealed), None
    if arguments.next:
        from epa_rt.cli.gap.blind.next import add_next

        def again(judged: list, answers: Path, hidden: list[Path]) -> None:
            add_next(arguments.cases, judged, answers, arguments.diagnoser, hidden, arguments.jobs)

    print(
        score(
            arguments.cases,
            sealed,
            arguments.json,
            arguments.html or arguments.json.with_suffix(".html"),
            arguments.diagnoser,
            arguments.jobs,
            again,
        )
    )
    return COMPLETED


def _oracle(arguments: argparse.Namespace) -> int:
    from epa_rt.cli.gap.blind.oracle import oracle_all
    from epa_rt.cli.gap.blind.oracle_next import oracle_next

    if arguments.next:
        print(
            oracle_next(
                arguments.cases,
                sealed_of(arguments.cases, arguments.sealed),
                arguments.json,
                arguments.jobs,
                arguments.answers,
            )
        )
        return COMPLETED
    print(
        oracle_all(
            arguments.cases,
            sealed_of(arguments.cases, arguments.sealed),
            arguments.json,
            arguments.jobs,
            arguments.answers,
            arguments.missed,
        )
    )
    return COMPLETED


def _rivals(arguments: argparse.Namespace) -> int:
    print(
        beside_libraries(
            arguments.cases,
            sealed_of(arguments.cases, arguments.sealed),
            arguments.json,
            arguments.only,
            arguments.jobs,
            arguments.first,
            arguments.beside,
        )
    )
    return COMPLETED


def _matrix(arguments: argparse.Namespace) -> int:
    from epa_rt.benchmark.matrix import matrix
    from epa_rt.cli.gap.blind.make import check_matrix, make_matrix

    check_folder(arguments.out)
    sealed = sealed_of(arguments.out, None)
    if not (arguments.out / "truth.sha256").exists():
        check_new(arguments.out, sealed)
    with alone(arguments.out):
        if (arguments.out / "truth.sha256").exists():
            check_matrix(arguments.seed, arguments.out, sealed, arguments.of)
            check_cases(arguments.out)
        else:
            make_matrix(
                arguments.seed,
                arguments.out,
                sealed,
                arguments.config,
                arguments.jobs,
                arguments.of,
            )
        print(matrix(arguments.out, sealed, arguments.diagnoser, arguments.jobs), file=sys.stdout)
    return COMPLETED
