"""python -m epa_rt is epa, and so is the script of that name."""

import sys

from epa_rt.cli.early import take_interrupts


def main() -> int:
    """Runs one verb; returns its exit code."""
    take_interrupts()
    from epa_rt.cli.main import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
