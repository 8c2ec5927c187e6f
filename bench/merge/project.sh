# Maps of simulated runs in stores; sourced by scripts that set `out` and `unimapper`.
# shellcheck shell=bash disable=SC2034,SC2154
# shellcheck source=bench/merge/runs.sh
source bench/merge/runs.sh

# map COMMAND STORE ARGUMENTS...: without its messages
map() { "$unimapper" map "$1" --store "$2" "${@:3}" >/dev/null 2>&1; }

# project STORE RUN...: a new store with these runs
project() {
  rm -rf "$1"
  mkdir -p "$(dirname "$1")"
  map create "$1"
  map add "$1" "${@:2}"
}

# merged_map STORE MAP RUN...: a new store with the map of these runs, which is exported to the folder MAP
merged_map() {
  project "$1" "${@:3}"
  map merge "$1"
  map export "$1" --out "$2" --replace
}

# measured NAME COMMAND...: runs it, its output in $out/NAME.txt; its peak memory and processor time are
# peak_mb[NAME] and seconds[NAME]
declare -A peak_mb=() seconds=()
measured() {
  local figures
  figures=$(python3 - "$out/$1.txt" "${@:2}" <<'PY'
import resource, subprocess, sys
subprocess.run(sys.argv[2:], stdout=open(sys.argv[1], "w"), stderr=subprocess.STDOUT, check=True)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(f"{used.ru_maxrss / 1000:.0f} {used.ru_utime + used.ru_stime:.1f}")
PY
  )
  peak_mb[$1]=${figures% *} seconds[$1]=${figures#* }
}
