# Runs of simulated recordings; sourced by scripts that set `out` and `unimapper`.
# shellcheck shell=bash disable=SC2154

# make_run NAME ARGUMENTS...: the run $out/runs/NAME of the recording that `unimapper simulate` makes
# with these arguments, and $out/data/NAME, the recording; without its scans, unless keep_scans is set.
# What is there stays.
make_run() {
  local name=$1 unfinished=$out/unfinished/${1##*/}
  [ ! -e "$out/runs/$name" ] || return 0
  rm -rf "$out/data/$name" "$out/unfinished"
  # The folder's name becomes the session's.
  "$unimapper" simulate "${@:2}" --out "$out/data/$name" >/dev/null 2>&1
  "$unimapper" onboard "$out/data/$name" --out "$unfinished" >/dev/null 2>&1
  [ -n "${keep_scans:-}" ] || rm -rf "$out/data/$name/scans" "$out/data/$name/labels"
  rm -rf "$unfinished/labels"
  mkdir -p "$(dirname "$out/runs/$name")"
  mv "$unfinished" "$out/runs/$name"
}
