# Doxygen input filter that documents the members of parameter structs from their tables.
#
# A member's meaning, unit and range stand once, in the table `parameters_of` below its struct; this
# appends them to the member's declaration, on the same line.
{ line[NR] = $0 }

END {
  for (i = 1; i <= NR; ++i) {
    if (match(line[i], /^template <std::same_as<[A-Za-z]+> C>/))
      text = text "struct " substr(line[i], RSTART + 24, RLENGTH - 27) " "
    text = text line[i] " "
  }
  gsub(/"[ \t]+"/, "", text)  # literals in pieces
  while (match(text, /struct [A-Za-z]+ |parameter<&C::[a-z0-9_]+>\( *("[^"]*"[, ]*)+\)/)) {
    row = substr(text, RSTART, RLENGTH)
    text = substr(text, RSTART + RLENGTH)
    if (row ~ /^struct/) { owner = substr(row, 8, length(row) - 8); continue }
    literals = split(row, literal, "\"")
    name = substr(literal[1], 15)
    sub(/>.*/, "", name)
    if (literals == 5) { meaning[owner, name] = literal[4]; continue }  # source, meaning
    unit = literal[4] == "" ? "" : " " literal[4]  # range, unit, source, meaning
    meaning[owner, name] = literal[8] " " literal[2] unit
  }

  owner = ""
  for (i = 1; i <= NR; ++i) {
    if (match(line[i], /^struct [A-Za-z]+ \{/)) owner = substr(line[i], 8, RLENGTH - 9)
    name = line[i]
    sub(/( = .*)?;.*/, "", name)
    sub(/.* /, "", name)
    known = line[i] ~ /^  [A-Za-z].*;/ && (owner SUBSEP name) in meaning
    print line[i] (known ? "  ///< " meaning[owner, name] : "")
  }
}
