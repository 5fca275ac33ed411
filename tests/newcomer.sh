#!/usr/bin/env bash
# What somebody types who has never seen the project, each command with its time, in an empty home that holds nothing but Rust:
#
#   tests/newcomer.sh FOLDER            from `git clone` to the answer of the README's first commands
#   tests/newcomer.sh FOLDER --wheel    from a wheel to a verdict, in an environment without Rust
#
# FOLDER must not exist; it takes the clone, the home, and what was made. Ends with 1 at the first command that fails, or whose page is missing.
set -euo pipefail
sources=$(cd "$(dirname "$0")/.." && pwd)
folder=${1:?usage: newcomer.sh FOLDER [--wheel]}
mkdir "$folder"
folder=$(cd "$folder" && pwd)
mkdir "$folder/home"
rust=${RUSTUP_HOME:-$HOME/.rustup}
commands=0

typed() { # types a line in a shell of its own, in the folder where the newcomer stands
  local begun=$SECONDS
  printf '$ %s\n' "$1"
  env -i HOME="$folder/home" RUSTUP_HOME="$rust" PATH="$PATH" TERM=dumb bash -euo pipefail -c "cd '$2'; $1"
  commands=$((commands + 1))
  printf -- '-- %s s\n' $((SECONDS - begun))
}

if [ "${2:-}" = --wheel ]; then
  typed "'$sources/python/build_and_test.sh' '$folder/wheel'" "$folder"
  page=$folder/wheel/report.html
else
  typed "git clone --quiet 'file://$sources' twinalign" "$folder"
  # The first block of commands in the README, as it stands there.
  first=$(sed -n '/^```sh$/,/^```$/{/^```/d;p}' "$folder/twinalign/README.md" | head -1)
  typed "${first%%#*}" "$folder/twinalign"
  page=$folder/twinalign/demo/report.html
fi
[ -s "$page" ] || { echo "no page: $page"; exit 1; }
echo "$commands commands, $SECONDS s, page: $page"
