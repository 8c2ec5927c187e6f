#!/usr/bin/env bash
# Check of doc comments and of the descriptions of parameters.
#
#   doc_comments.sh PATH...    C++ and C files below these paths, without src/page
#
# An editor and the API reference show each by itself: none ends in a comma, colon or semicolon, and
# none begins with words that refer to another one. Blocks and descriptions end in a full stop.
# Prints one line per finding and fails if there is any.
set -euo pipefail

files=$(find "$@" -type f \( -name '*.h' -o -name '*.[ch]pp' \) ! -path '*src/page/*' | sort)
[ -n "$files" ] || { echo "error: no files to check" >&2; exit 1; }

found=$(echo "$files" | xargs awk '
  function check(line, kind, text) {
    gsub(/[ \t]+/, " ", text)
    gsub(/^ | $/, "", text)
    line = file ":" line ": " kind
    if (text ~ /[,:;]$/) print line " ends within a sentence: " text
    else if (kind !~ /trailing/ && text !~ /[.!?][)"`]?$/) print line " ends without a full stop: " text
    if (tolower(text) ~ leaning) print line " refers to another one: " text
  }
  function begin_comment(next_kind) {
    if (kind) check(start, kind, text)
    kind = next_kind; text = ""; start = FNR
  }
  # The last argument is the description; adjacent strings are one.
  function end_call(   last) {
    for (; match(call, string); call = substr(call, RSTART + RLENGTH))
      last = (substr(call, 1, RSTART - 1) ~ /^ *$/ ? last : "") substr(call, RSTART + 1, RLENGTH - 2)
    check(row, "description", last)
    call = ""
  }
  FNR == 1 { begin_comment(""); file = FILENAME; call = ""; inside = 0 }
  inside || match($0, /\/\*\*<?/) {  # C
    if (!inside) begin_comment(substr($0, RSTART + 3, 1) == "<" ? "trailing comment" : "comment")
    sub(inside ? "^ *[*] " : "^.*/[*][*]<?", "")
    inside = !sub(/ *\*\/.*/, "")
    text = text " " $0
    if (!inside) begin_comment("")
    next
  }
  {
    alone = match($0, /^ *\/\/\//)
    now = $0 ~ /\/\/\/</ ? "trailing comment" : alone ? "comment" : ""
    if (now != kind || !alone) begin_comment(now)
    if (now && match($0, /\/\/\/<?/)) text = text " " substr($0, RSTART + RLENGTH)
  }
  !call && match($0, /(^|[ (])parameter<&/) { row = FNR; call = substr($0, RSTART + 1) }
  call {
    if (row < FNR) call = call $0
    bare = call
    gsub(string, "", bare)
    if (bare ~ /\)/) end_call()
  }
  END { begin_comment("") }' string='"([^"\\\\]|\\\\.)*"' \
  leaning='^(of (which|them|it|these)|the same|and|but|or|also|likewise|as (above|before))([^a-z]|$)')

[ -z "$found" ] || { echo "$found"; exit 1; }
