"""`python -m app` is `phalanx`."""

import sys

from app.cli import main

sys.exit(main())
