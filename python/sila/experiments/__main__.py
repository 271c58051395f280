"""`python -m sila.experiments`: as `sila experiment`."""

import sys

from .program import run

sys.exit(run(sys.argv[1:]))
