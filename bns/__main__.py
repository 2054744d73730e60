"""`python -m bns`."""

import sys

from bns.cli import main

sys.exit(main())
