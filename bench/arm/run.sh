#!/usr/bin/env bash
# Instructions per keyframe and stage on x86-64, aarch64 and ARMv7, counted in qemu's user mode.
#
#   run.sh [DATASET [SENSOR]]     without arguments KITTI's drive 0005 out of ../shared/data
#
# Driven there and back; counted are ten keyframes after the warm-up (bench/latency/drive.hpp). Equal
# machine code gives equal counts, whatever the load of this machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=bench/tables/common.sh
source bench/tables/common.sh

out=build/bench
dataset=${1:-}
sensor=${2:-hdl-64e}
if only_layout; then
  dataset=kitti_0005a
elif [ -z "$dataset" ]; then
  [ -e ../shared/data/unpack.sh ] || {
    echo "error: no recordings beside the project; name a data set: bench/arm/run.sh DATASET [SENSOR]" >&2
    exit 1
  }
  dataset=$(sh ../shared/data/unpack.sh "$out/recordings")/kitti_0005a
fi

# count PRESET EMULATOR [EMULATOR ARGS]: builds what the preset makes, and runs it.
count() {
  local preset=$1 emulator=$2
  shift 2
  cmake --preset "$preset" -Wno-dev >"$out/$preset.log"
  cmake --build "build/$preset" --target stage_instructions >>"$out/$preset.log"
  "$emulator" "$@" -plugin "$plugin" "build/$preset/bin/stage_instructions" "$dataset" "$sensor" \
    --there-and-back >"$out/$preset.instructions"
}

library_path() { echo "LD_LIBRARY_PATH=build/package-roots/$1/usr/lib/$2"; }

count_all() {
  plugin="$out/count_instructions.so"
  mkdir -p "$out"
  gcc -O2 -shared -fPIC -fvisibility=hidden -o "$plugin" bench/arm/count_instructions.c
  count release qemu-x86_64
  count aarch64 qemu-aarch64 -L /usr/aarch64-linux-gnu -E "$(library_path arm64 aarch64-linux-gnu)"
  count armv7-neon qemu-arm -L /usr/arm-linux-gnueabihf -E "$(library_path armhf arm-linux-gnueabihf)"
}

instructions_table() {
  local stage
  echo "| million instructions per keyframe, $(basename "$dataset") there and back | x86-64 | aarch64 | ARMv7 + NEON |"
  rule 4
  for stage in ingest removal description search total; do row $stage 3 stage_cells $stage; done
  row "the call that closes the keyframe" 3 stage_cells closing-call
  row "longest call" 3 stage_cells longest-call
}
stage_cells() {
  awk -v stage="$1" '
    $1 == stage { count[FILENAME] = $2 }
    END {
      x86 = count[ARGV[1]]
      printf "%.2f", x86 / 1e6
      for (i = 2; i < ARGC; ++i)
        printf " | %.2f (%.2f x)", count[ARGV[i]] / 1e6, count[ARGV[i]] / x86
    }' "$out"/{release,aarch64,armv7-neon}.instructions
}

only_layout || count_all
table arm-instructions instructions_table
