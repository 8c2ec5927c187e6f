# Processes of the demonstration's scripts: they end with the script, which adds them to `pids`.
# Sourced by those scripts.
# shellcheck shell=bash
pids=()
end_all() {
  local pid
  for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
}
trap end_all EXIT
trap 'exit 130' INT TERM
