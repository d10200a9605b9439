#!/bin/sh
# Installs the programs that exports are opened in: Python's into .venv-acceptance, beside Phalanx; Blender, which asks
# for a numpy older than Phalanx's, into .venv-blender; those of Node into tests/acceptance/node_modules.
# What cannot be had on this machine is said and left out: its tests are then skipped. Needs .venv (make setup).
set -eu

cd "$(dirname "$0")/.."
VENV=.venv-acceptance
BLENDER=.venv-blender
NODE=tests/acceptance
STAMP=$VENV/.phalanx-stamp

say() { printf 'phalanx: %s\n' "$*" >&2; }

pip() {
    python=$1
    shift
    PYTHONWARNINGS=ignore "$python" -m pip --disable-pip-version-check --no-input install -q --retries 10 --timeout 60 "$@"
}

fingerprint() {
    cat pyproject.toml packaging/constraints.txt packaging/blender.txt packaging/acceptance.sh $NODE/package.json | cksum
    .venv/bin/python -VV
    command -v node || true
    pwd
}

if [ -f "$STAMP" ] && [ "$(cat "$STAMP")" = "$(fingerprint)" ]; then
    exit
fi
say "installing the programs that exports are opened in (Blender alone is 360 MB to download; 3 GB on the disk)"
rm -rf "$VENV" "$BLENDER"

.venv/bin/python -m venv "$VENV"
pip "$VENV/bin/python" --constraint packaging/constraints.txt pip setuptools
pip "$VENV/bin/python" --constraint packaging/constraints.txt --no-build-isolation --editable '.[dev]'
"$VENV/bin/python" -c 'import tomllib
for need in tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["acceptance"]: print(need)' |
    while read -r need; do
        pip "$VENV/bin/python" --constraint packaging/constraints.txt "$need" || say "left out, for it cannot be installed here: $need"
    done

.venv/bin/python -m venv "$BLENDER"
pip "$BLENDER/bin/python" --requirement packaging/blender.txt || {
    say "left out, for it cannot be installed here: Blender as a module of this Python"
    rm -rf "$BLENDER"
}

if ! command -v npm >/dev/null 2>&1; then
    say "left out, for there is no Node here: three.js and the validator of glTF"
elif ! (cd $NODE && rm -rf node_modules && npm install --silent); then
    say "left out, for npm cannot install them here: three.js and the validator of glTF"
fi
fingerprint >"$STAMP"
