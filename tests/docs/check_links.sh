#!/usr/bin/env bash
# Every relative link and picture of the given Markdown files must lead to a file or folder of the repository.
# usage: check_links.sh ROOT FILE.md...
set -euo pipefail

root="$1"
shift
failures=0
for document in "$@"; do
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
