#!/bin/sh
# All tests. Those that keep no time run in two processes at once: core, then commands and exports beside measures and
# review. All others run alone afterwards, for live windows, sockets and clocks need the machine to themselves.
set -u
cd "$(dirname "$0")/.."
PYTEST=".venv/bin/python -m pytest"

log=$(mktemp)
beside=
status=0
trap '[ -z "$beside" ] || kill $beside 2>/dev/null; rm -f "$log"' EXIT
trap 'exit 130' INT TERM

# Some tests beside others: two lists of paths, each one word.
both() {
    # shellcheck disable=SC2086 # the lists are of several words
    $PYTEST $1 >"$log" 2>&1 &
    beside=$!
    # shellcheck disable=SC2086
    $PYTEST $2 || status=$?
    wait $beside || status=$?
    beside=
    cat "$log"
}

COMMANDS="$(echo tests/app/test_cli*.py tests/app/test_e*.py tests/app/test_import.py)"
MEASURES="$(echo tests/app/test_b*.py tests/app/test_c[ae]*.py tests/app/test_r[eu][clnsu]*.py tests/app/test_pe[eo][rp]*.py)"
both "$(echo tests/core/[a-l]*)" "$(echo tests/core/[m-z]*)"
REVIEW="$(echo tests/app/test_review*.py)"
both "$MEASURES $REVIEW" "$COMMANDS" # what a shell begins in the background is deaf to Ctrl+C, which commands are tried with
ignored=
for path in tests/core $COMMANDS $MEASURES $REVIEW; do ignored="$ignored --ignore=$path"; done
# shellcheck disable=SC2086
$PYTEST $ignored || status=$?
exit $status
