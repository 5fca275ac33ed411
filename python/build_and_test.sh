#!/usr/bin/env bash
# Builds the wheel and tests it in a clean virtual environment: python/build_and_test.sh FOLDER [SESSION]
# FOLDER takes the wheel and the environment. SESSION: a session of an arm alone, for the tests that need one.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
folder=${1:?usage: build_and_test.sh FOLDER [SESSION]}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
session=${2:+$(cd "$2" && pwd)}
python3 -m venv --clear "$folder/venv"
python=$folder/venv/bin/python
"$python" -m pip install --quiet --upgrade pip
"$python" -m pip wheel --quiet --no-deps --wheel-dir "$folder" "$here"
"$python" -m pip install --quiet --force-reinstall "$folder"/twinalign-*.whl "gymnasium>=1.0"
cd "$folder" # not the sources: what was installed is tested
TWINALIGN_SESSION=$session "$python" -m unittest discover -s "$here/tests"
