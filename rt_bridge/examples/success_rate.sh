#!/usr/bin/env bash
# How many commands of a 1 kHz torque loop reach the served robot in time, and franka-sim in turns with it, ten seconds each.
#   rt_bridge/examples/success_rate.sh TIMES FR3.xml      as root, with pylibfranka and franka-sim installed (PyPI)
# libfranka knows one port, and franka-sim takes it at every address of a machine: it gets a network of its own.
set -euo pipefail
times=$1 model=$2
here=$(cd "$(dirname "$0")" && pwd)
bridge=${RT_BRIDGE:-$here/../../target/release/rt_bridge}

FR3_MJCF=$model unshare --net sh -c 'ip link set lo up && exec run-franka-sim-server --physics mujoco --no-gripper' 2>/dev/null &
peer=$!
"$bridge" serve --cell "$here/../../config/fr3_cell.toml" 2>/dev/null &
served=$!
trap 'kill $served $peer' EXIT
sleep 8
uptime
for _ in $(seq "$times"); do
  printf 'served      '; python3 "$here/success_rate.py" 10 127.0.0.1
  printf 'franka-sim  '; nsenter --target $peer --net python3 "$here/success_rate.py" 10 127.0.0.1
done
uptime
