#!/usr/bin/env bash
# Every C++ block of the documents must be quoted from a source that is compiled and run.
#
# A block is announced by a comment on a line of its own, an empty line between them or not:
#   <!-- quote examples/fit_in_five_lines.cpp fit -->
# It must equal what stands between the lines `// begin: fit` and `// end: fit` of that file, indentation removed.
# usage: check_quotes.sh ROOT [FILE.md...]    files are named from ROOT, the folder of the repository;
#        default: those at the top and in docs/ and examples/
set -euo pipefail

root="$1"
shift
documents=("$@")
if ((${#documents[@]} == 0)); then
  mapfile -t documents < <(cd -- "$root" && ls -- *.md docs/*.md examples/*.md)
fi
failures=0

complain() {
  echo "$*" >&2
  failures=$((failures + 1))
}

# The part of a source between its markers, without the indentation of its first line.
part_of() {
  awk -v part="$2" '
    { line = $0; sub(/^[ \t]+/, "", line); sub(/[ \t]+$/, "", line) }
    line == "// end: " part { inside = 0; ended = 1 }
    inside {
      if (!seen) { match($0, /^ */); indent = RLENGTH; seen = 1 }
      match($0, /^ */)
      print substr($0, (RLENGTH < indent ? RLENGTH : indent) + 1)
    }
    line == "// begin: " part { inside = 1; begun = 1 }
    END { exit !(begun && ended) }' "$1"
}

check_block() {  # document line, source, part, text
  local where="$1" source="$2" part="$3" block="$4" wanted
  if [[ -z "$source" ]]; then
    complain "$where: a C++ block without a comment <!-- quote FILE PART -->"
  elif [[ ! -f "$root/$source" ]]; then
    complain "$where: no file $source"
  elif ! wanted="$(part_of "$root/$source" "$part")"; then
    complain "$where: $source has no lines '// begin: $part' and '// end: $part'"
  elif [[ "$block" != "$wanted" ]]; then
    complain "$where: differs from $source, part '$part':"
    diff <(echo "$block") <(echo "$wanted") >&2 || true
  fi
}

for document in "${documents[@]}"; do
  number=0
  source="" part="" block="" inside=no
  while IFS= read -r line || [[ -n "$line" ]]; do
    number=$((number + 1))
    if [[ "$inside" == yes ]]; then
      if [[ "$line" == '```' ]]; then
        check_block "$document:$number" "$source" "$part" "${block%$'\n'}"
        inside=no source="" part="" block=""
      else
        block+="$line"$'\n'
      fi
    elif [[ "$line" =~ ^\<\!--\ quote\ ([^ ]+)\ ([^ ]+)\ --\>$ ]]; then
      source="${BASH_REMATCH[1]}" part="${BASH_REMATCH[2]}"
    elif [[ "$line" == '```cpp' ]]; then
      inside=yes
    elif [[ -n "$line" ]]; then
      [[ -z "$source" ]] || complain "$document:$number: a quote comment without a C++ block behind it"
      source="" part=""
    fi
  done <"$root/$document"
  [[ "$inside" == no ]] || complain "$document: a C++ block does not end"
done

if ((failures > 0)); then
  echo "$failures mistakes" >&2
  exit 1
fi
