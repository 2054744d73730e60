"""`python -m bns`."""

import sys

from bns.cli.main import main

sys.exit(main())
