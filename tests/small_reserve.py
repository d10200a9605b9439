"""The `phalanx` command with another reserve of free bytes than 1 GB, for disks of a test:

python -m tests.small_reserve BYTES record ...
"""

from __future__ import annotations

import sys

from app.session import Session

if __name__ == "__main__":
    assert Session.__init__.__kwdefaults__ is not None
    Session.__init__.__kwdefaults__["disk_reserve_bytes"] = int(sys.argv[1])
    from app.cli import main

    sys.exit(main(sys.argv[2:]))
