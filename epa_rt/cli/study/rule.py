"""An experiment at the pressure that a rule says is best for a frequency; epa run takes it on a rig
like config/rigs/mass.yaml.

  epa study rule rule.yaml --frequency '20 rad/s' -o best.yaml
  epa run best.yaml --rig config/rigs/mass.yaml
"""

import argparse
from pathlib import Path

from epa_rt.cli.exits import COMPLETED, VerbError
from epa_rt.cli.parser import summary


def add_parser(tasks: argparse._SubParsersAction) -> None:
    parser = tasks.add_parser(
        "rule",
        help=summary(__doc__),
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "rule", type=Path, metavar="RULE.yaml", help="rule file that epa study serial -o wrote"
    )
    parser.add_argument("--frequency", required=True, help="of the wanted sine, in Hz or rad/s")
    parser.add_argument(
        "--seconds", type=float, default=30.0, help="length of the trial (default: %(default)s)"
    )
    parser.add_argument(
        "-o",
        "--out",
        type=Path,
        required=True,
        metavar="EXPERIMENT.yaml",
        help="experiment file to write",
    )


def run(arguments: argparse.Namespace) -> int:
    from epa_rt.cli.write import check_own, check_writable, write_whole
    from epa_rt.config.units import UnitError
    from epa_rt.study.rule import experiment_text, load_rule
    from epa_rt.study.setting import angular

    check_writable(arguments.out, (".yaml", ".yml"))
    check_own(arguments.out, "epa study rule")
    if not 1.0 <= arguments.seconds <= 3600.0:
        raise VerbError(f"--seconds: found {arguments.seconds:g}, expected 1 to 3600")
    rule = load_rule(arguments.rule)
    try:
        frequency = angular(arguments.frequency)
        text = experiment_text(rule, frequency, arguments.seconds)
    except (UnitError, ValueError) as error:
        raise VerbError(f"--frequency: {error}") from None
    write_whole(arguments.out, text)
    print(
        f"{frequency:.4g} rad/s: {rule.at(frequency) / 1e3:.1f} kPa (absolute, at no-load length)"
        f" takes the least {rule.goal}"
    )
    print(arguments.out)
    return COMPLETED
