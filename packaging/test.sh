#!/bin/sh
# All tests. Those of core open no window and keep no time: they run in two processes at once. All others run alone
# afterwards, for windows, sockets and clocks need the machine to themselves.
set -u
cd "$(dirname "$0")/.."
PYTEST=".venv/bin/python -m pytest"

log=$(mktemp)
status=0
$PYTEST tests/core/[a-l]* >"$log" 2>&1 &
first=$!
trap 'kill $first 2>/dev/null; rm -f "$log"' EXIT
trap 'exit 130' INT TERM
$PYTEST tests/core/[m-z]* || status=$?
wait $first || status=$?
cat "$log"
$PYTEST --ignore=tests/core || status=$?
exit $status
