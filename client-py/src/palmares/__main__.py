"""``python -m palmares``: the program."""

import sys

from palmares.program import main

sys.exit(main())
