// Negative controls of the stack test: one function per violation.

void use(volatile char*);

[[gnu::noinline]] void spend(volatile char* bytes) { *bytes = 1; }

void large_frame() {
  volatile char bytes[70000];
  spend(bytes);
}

[[gnu::noinline]] int recursion(int n) {
  volatile char byte = 0;
  spend(&byte);
  return n == 0 ? byte : recursion(n - 1) * 3 + byte;
}

void unbounded_frame(unsigned n) {
  auto* bytes = static_cast<volatile char*>(__builtin_alloca(n));
  spend(bytes);
}

int call_through_pointer(int (*function)()) { return function() + 1; }

void unknown_code() {
  volatile char byte = 0;
  use(&byte);
}
