# Batch of test files as one translation unit: awk -v out=UNIT -f batch.awk FILE...
#
# Writes the headers of all files, then each file in a namespace that bears its name, so that
# helpers of equal names do not meet. Headers that a file includes again are empty by then.
/^#include/ && !seen[$0]++ { print >out }
END {
  for (i = 1; i < ARGC; ++i) {
    name = ARGV[i]
    sub(/.*\//, "", name)
    sub(/\.cpp$/, "", name)
    printf "namespace %s {\n#include \"%s\"\n}  // namespace %s\n", name, ARGV[i], name >out
  }
}
