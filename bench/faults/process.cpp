// Process with its peak memory: runs a command and writes its number, its end and its memory to a
// file.
//   fault_process REPORT COMMAND...
//
// SIGTERM is passed on; the command is killed when this process ends, however that happens.
#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>

namespace {

volatile pid_t child = 0;

void pass_on(int signal) { kill(child, signal); }

[[noreturn]] void run(pid_t parent, char** command) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);
  execvp(command[0], command);
  std::perror(command[0]);
  _exit(127);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: fault_process REPORT COMMAND...\n");
    return 2;
  }
  std::FILE* report = std::fopen(argv[1], "we");
  if (report == nullptr) {
    std::perror(argv[1]);
    return 2;
  }
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  const pid_t own = getpid();
  child = fork();
  if (child == 0) run(own, argv + 2);
  if (child < 0) {
    std::perror("fork");
    return 2;
  }
  struct sigaction action {};
  action.sa_handler = pass_on;
  sigaction(SIGTERM, &action, nullptr);
  std::fprintf(report, "pid %d\n", static_cast<int>(child));
  std::fflush(report);
  int status = 0;
  rusage usage{};
  while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) continue;
  if (WIFSIGNALED(status)) {
    std::fprintf(report, "signal %d\n", WTERMSIG(status));
  } else {
    std::fprintf(report, "exit %d\n", WEXITSTATUS(status));
  }
  std::fprintf(report, "peak_kb %ld\n", usage.ru_maxrss);
  std::fclose(report);
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}
