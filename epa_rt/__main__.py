"""python -m epa_rt is epa."""

import sys

from epa_rt.cli.main import main

sys.exit(main())
