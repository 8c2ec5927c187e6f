// Tests of the load of a host.
#include "ports/linux/host_load.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include "tests/test.hpp"

using namespace unimapper::linux_port;

TEST_CASE("the processor is what the system calls it") {
  CHECK(processor_model("processor\t: 0\nmodel\t\t: 85\nmodel name\t: Made Up 3 @ 2.5 GHz\n") ==
        "Made Up 3 @ 2.5 GHz");
  CHECK(processor_model("processor\t: 0\nBogoMIPS\t: 108\nModel\t\t: Small Board 4\n") ==
        "Small Board 4");
  CHECK(processor_model("").empty());
  CHECK(processor_model("model name").empty());
  CHECK(processor_model("model name :   ").empty());
}

TEST_CASE("what opens and cannot be read is empty, as a file of a process that ends meanwhile") {
  CHECK(text_of_file("/proc").empty());
  CHECK(text_of_file("/proc/nobody").empty());
  CHECK(!text_of_file("/proc/self/comm").empty());
}

TEST_CASE("the load is the first figure, or unknown") {
  CHECK(load_of_a_minute("4.95 4.29 3.43 7/391 12345\n") == 4.95);
  CHECK(load_of_a_minute("0.00") == 0.0);
  CHECK(load_of_a_minute("") < 0.0);
  CHECK(load_of_a_minute("much") < 0.0);
}

TEST_CASE("another process of the same program counts until it has ended") {
  const HostLoad alone = host_load();
  CHECK(alone.cores >= 1);
  REQUIRE(alone.same_program >= 1);
  int hold[2];
  REQUIRE(pipe(hold) == 0);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    close(hold[1]);
    char byte = 0;
    (void)!read(hold[0], &byte, 1);
    _exit(0);
  }
  close(hold[0]);
  const HostLoad both = host_load();
  close(hold[1]);
  REQUIRE(waitpid(child, nullptr, 0) == child);
  CHECK(both.same_program == alone.same_program + 1);
  CHECK(host_load().same_program == alone.same_program);
}
