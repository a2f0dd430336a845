"""Print what makes a shell complete the verbs, options and files of epa.

For one session, or as a line of ~/.bashrc, ~/.zshrc or ~/.config/fish/config.fish:

  eval "$(epa completion bash)"
  eval "$(epa completion zsh)"
  epa completion fish | source
"""

import argparse

from epa_rt.cli.exits import COMPLETED

SHELLS = ("bash", "zsh", "fish")


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("shell", choices=SHELLS, help="the shell that asks")


def main(arguments: argparse.Namespace) -> int:
    import argcomplete

    print(argcomplete.shellcode(["epa"], shell=arguments.shell))
    return COMPLETED
