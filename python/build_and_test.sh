#!/usr/bin/env bash
# Builds a wheel that holds the package and the program `twinalign`, and tests both in a clean virtual environment, without Rust:
# python/build_and_test.sh FOLDER [SESSION]
# FOLDER takes the wheel and the environment. SESSION: a session of an arm alone, for the tests that need one; else one is made.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
folder=${1:?usage: build_and_test.sh FOLDER [SESSION]}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
session=${2:+$(cd "$2" && pwd)}
python3 -m venv --clear "$folder/venv"
python=$folder/venv/bin/python
"$python" -m pip install --quiet --upgrade pip wheel
rm -rf "$folder"/twinalign-*.whl "$folder/unpacked"
"$python" -m pip wheel --quiet --no-deps --wheel-dir "$folder" "$here"
# The program beside the package: what stands under scripts/ goes into the environment's bin/.
cargo build --release --locked --manifest-path "$here/../Cargo.toml" --package twinalign
"$python" -m wheel unpack --dest "$folder/unpacked" "$folder"/twinalign-*.whl
for package in "$folder"/unpacked/twinalign-*; do
  install -D --strip "${CARGO_TARGET_DIR:-$here/../target}/release/twinalign" "$package/$(basename "$package").data/scripts/twinalign"
  "$python" -m wheel pack --dest-dir "$folder" "$package"
done
rm -rf "$folder/unpacked"
"$python" -m pip install --quiet --force-reinstall "$folder"/twinalign-*.whl "gymnasium>=1.0"
cd "$folder" # not the sources: what was installed is tested
export PATH=$folder/venv/bin:/usr/bin:/bin
if [ -z "$session" ]; then
  session=$folder/session
  twinalign example "$session" --force
fi
time twinalign check "$session"
time twinalign diagnose "$session" --report "$folder/report.html"
TWINALIGN_SESSION=$session "$python" -m unittest discover -s "$here/tests"
