#!/bin/sh
# Writes constraints.txt anew: the newest versions that pyproject.toml allows, as a fresh environment gets them.
# The pins of the extras "train", "bench" and "acceptance" stay as they are: they are chosen by hand.
set -eu
cd "$(dirname "$0")/.."
fresh=$(mktemp -d)
trap 'rm -rf "$fresh"' EXIT
.venv/bin/python -m venv "$fresh/venv"
pip="$fresh/venv/bin/python -m pip"
$pip install -q --upgrade pip setuptools
$pip install -q --no-build-isolation --editable '.[dev]'
{
    sed '/^[^#]/,$d' packaging/constraints.txt
    $pip freeze --all --exclude-editable | grep '==' | LC_ALL=C sort -f
    sed -n '/^# Only in extra "train"/,$p' packaging/constraints.txt
} >"$fresh/constraints.txt"
cp "$fresh/constraints.txt" packaging/constraints.txt
