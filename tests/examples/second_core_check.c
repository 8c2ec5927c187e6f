/* The executor of docs/examples/second_core.c, task after task. */
#define main example_main
#include "docs/examples/second_core.c"
#undef main

enum { kMostParts = 20, kTasks = 20000 };

static void mark(void* task, uint32_t part, uint32_t worker) {
  ((unsigned char*)task)[part] += worker < 2 ? 1 : 2;
}

int main(void) {
  if (example_main() != 0) return 1;
  for (uint32_t task = 0; task < kTasks; ++task) {
    unsigned char marks[kMostParts] = {0};
    const uint32_t parts = task % kMostParts;
    run(NULL, parts, mark, marks);
    for (uint32_t i = 0; i < kMostParts; ++i) {
      if (marks[i] != (i < parts ? 1 : 0)) return printf("task %u, part %u\n", task, i), 1;
    }
  }
  printf("every part once\n");
}
