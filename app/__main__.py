"""The program `phalanx`, also as `python -m app`.

Until a command's own handling stands, Ctrl+C ends it at once: nothing is begun, and an interruption of what is being
imported would be shown as an error, or be lost.
"""

import signal

if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not where whoever began it had it ignored
    signal.signal(signal.SIGINT, signal.SIG_DFL)

import sys

from app.cli import main

if __name__ == "__main__":
    sys.exit(main())
