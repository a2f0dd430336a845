"""python -m epa_rt is epa, and so is the script of that name."""

import sys

from epa_rt.cli.early import end_at_interrupts, take_interrupts


def main() -> int:
    """Runs one verb; returns its exit code."""
    take_interrupts()
    from epa_rt.cli.main import main as run

    code = run()
    end_at_interrupts()
    return code


if __name__ == "__main__":
    sys.exit(main())
