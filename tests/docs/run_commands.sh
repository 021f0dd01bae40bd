#!/usr/bin/env bash
# Runs the commands of a Markdown file: every ```sh block announced by a comment line <!-- run -->, in order, with the
# built program as `blockid` and the repository's examples/ in the current folder. The first that fails ends the test.
# usage: run_commands.sh ROOT FILE.md PROGRAM SCRATCH
set -euo pipefail

root="$1" document="$2" program="$3" scratch="$4"
mkdir -p -- "$scratch"
cd -- "$scratch"
ln -sfn -- "$root/examples" examples
PATH="$(dirname -- "$program"):$PATH"

commands="$(awk '
  /^<!-- run -->$/ { announced = 1; next }
  inside && /^```$/ { inside = 0; next }
  inside { print }
  announced && /^```sh$/ { inside = 1; announced = 0; count++ }
  END { exit count == 0 }' "$root/$document")"
set -x
eval "set -e; $commands"
