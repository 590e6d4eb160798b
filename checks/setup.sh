#!/usr/bin/env bash
# Installs the programs of `cargo xtask foreign` into target/checks: Python packages, Node packages and, for root on Debian, chromium.
# What cannot be installed is left out, and its checks are skipped.
set -uo pipefail
cd "$(dirname "$0")/.."
folder="${CARGO_TARGET_DIR:-target}/checks"
mkdir -p "$folder"
missing=()

python3 -m venv "$folder/python" && "$folder/python/bin/python" -m pip install --quiet -r checks/requirements.txt \
  || missing+=("Python packages (Python 3.11 and pip are needed)")

npm install --silent --no-save --no-package-lock --prefix "$folder" gltf-validator@2.0.0-dev.3.10 playwright-core@1.65.1 \
  || missing+=("Node packages (Node 18 and npm are needed)")

if ! command -v chromium >/dev/null; then
  if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    { apt-get update -qq && apt-get install -y -qq --no-install-recommends chromium fonts-dejavu-core; } >/dev/null \
      || missing+=("chromium")
  else
    missing+=("chromium (install Debian's package)")
  fi
fi

# pymeshlab and vtk want these of the system, also without a screen.
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null && ! ldconfig -p | grep -q libGL.so.1; then
  apt-get install -y -qq --no-install-recommends libgl1 libopengl0 >/dev/null || missing+=("libgl1")
fi

for what in "${missing[@]}"; do echo "not installed: $what" >&2; done
[ "${#missing[@]}" = 0 ]
