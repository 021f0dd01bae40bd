#!/usr/bin/env bash
# Every relative link and picture of the given Markdown files must lead to a file or folder of the repository.
# usage: check_links.sh ROOT [FILE.md...]    default: all of the repository
set -euo pipefail

root="$1"
shift
documents=("$@")
if ((${#documents[@]} == 0)); then
  mapfile -t documents < <(cd -- "$root" && find . -name build -prune -o -name .git -prune -o -name '*.md' -printf '%P\n' | sort)
fi
failures=0
for document in "${documents[@]}"; do
  folder="$(dirname -- "$root/$document")"
  while IFS= read -r target; do
    target="${target%%#*}"
    case "$target" in
      '' | *://* | mailto:*) continue ;;
    esac
    if [[ ! -e "$folder/$target" ]]; then
      echo "$document: a link to $target, which is not there" >&2
      failures=$((failures + 1))
    fi
  done < <(awk '/^```/ { code = !code } !code' "$root/$document" | grep -oE '\]\([^()[:space:]]+\)' | sed -E 's/^\]\((.*)\)$/\1/' || true)
done
((failures == 0))
