#!/bin/sh
# Makes .venv ready: system libraries if any are missing, Python packages at the versions of constraints.txt.
# A second run finds everything in place and takes a fraction of a second. Touches apt only if something is missing.
set -eu

cd "$(dirname "$0")/.."
VENV=.venv
STAMP=$VENV/.phalanx-stamp

say() { printf 'phalanx: %s\n' "$*" >&2; }
fail() { say "$@"; exit 1; }

python_fits() { "$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 14))' 2>/dev/null; }

find_python() {
    for candidate in ${PYTHON:-python3 python3.13 python3.12 python3.11}; do
        if command -v "$candidate" >/dev/null 2>&1 && python_fits "$candidate"; then
            command -v "$candidate"
            return
        fi
    done
    found=$(python3 --version 2>&1) || found="no python3"
    fail "needs Python 3.11, 3.12 or 3.13 and found ${found}." \
        "Install one of these (Debian 12, Ubuntu 24.04 or newer have it) or name it: make PYTHON=/path/to/python3.12 run"
}

# Lines of: <shared library or /command> <Debian package that brings it>
SYSTEM_PARTS=resources/system_libraries.txt

missing_packages() {
    libraries=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null) || libraries=
    while read -r part package; do
        case $part in
            '' | '#'*) ;;
            /*) command -v "${part#/}" >/dev/null 2>&1 || echo "$package" ;;
            *) case $libraries in *"$part "*) ;; *) echo "$package" ;; esac ;;
        esac
    done <"$SYSTEM_PARTS"
    # Debian keeps the part of venv that brings pip in a package of its own.
    if [ ! -x "$VENV/bin/python" ] && ! "$PYTHON_FOUND" -c 'import ensurepip, venv' 2>/dev/null; then
        "$PYTHON_FOUND" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])'
    fi
}

install_packages() {
    say "installing system packages: $*"
    command -v apt-get >/dev/null 2>&1 ||
        fail "this system has no apt-get. Install what these Debian packages bring, then run again: $*"
    as_root=
    if [ "$(id -u)" != 0 ]; then
        command -v sudo >/dev/null 2>&1 ||
            fail "not root, and there is no sudo. Ask an administrator for: apt-get install --no-install-recommends $*"
        as_root=sudo
    fi
    $as_root apt-get -q -o DPkg::Lock::Timeout=300 update >&2 ||
        say "apt-get update reported errors; going on with the package lists at hand."
    $as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get -q -y -o DPkg::Lock::Timeout=300 install --no-install-recommends "$@" >&2 ||
        fail "apt-get could not install: $*. Its message is above; mend that and run again."
}

fingerprint() { cat pyproject.toml packaging/constraints.txt packaging/bootstrap.sh | cksum; "$VENV/bin/python" -VV; pwd; }

install_python_packages() {
    "$VENV/bin/python" -c '' 2>/dev/null || rm -rf "$VENV" # e.g. its Python is gone
    [ -x "$VENV/bin/python" ] || "$PYTHON_FOUND" -m venv "$VENV"
    if [ -f "$STAMP" ] && [ "$(cat "$STAMP")" = "$(fingerprint)" ]; then
        return
    fi
    say "installing Python packages into $VENV (about 250 MB to download the first time)"
    pip="env PYTHONWARNINGS=ignore $VENV/bin/python -m pip --disable-pip-version-check --no-input install -q --retries 10 --timeout 60"
    $pip --constraint packaging/constraints.txt pip setuptools &&
        $pip --constraint packaging/constraints.txt --no-build-isolation --editable '.[dev]' ||
        fail "Python packages could not be installed. pip's message is above; check the network and run again."
    fingerprint >"$STAMP"
}

PYTHON_FOUND=$(find_python)
missing=$(missing_packages | sort -u | tr '\n' ' ')
# shellcheck disable=SC2086 # a list of words
[ -z "${missing% }" ] || [ "$(uname)" != Linux ] || install_packages $missing
install_python_packages
