/* qemu plugin that counts the guest's instructions and reports the count to the guest.
 *
 * Independent of the guest's processor. A guest requests the count by ioctl(fd, COUNT_REQUEST) on
 * the writing end of a pipe and then reads eight bytes from the other end: the count in the host's
 * byte order. Without the plugin the ioctl fails and nothing is written.
 *
 * qemu publishes its plugin interface as a header, which Debian does not package; what is used of
 * it is declared here (interface version 1, qemu 4.2 to 8.x).
 */
#include <stddef.h>
#include <stdint.h>
#include <unistd.h>

#define COUNT_REQUEST 0x554D4943u
#define EXPORTED __attribute__((visibility("default")))

struct block;
enum inline_operation { ADD_TO_WORD };

void qemu_plugin_register_vcpu_tb_trans_cb(uint64_t id,
                                           void (*translated)(uint64_t, struct block*));
size_t qemu_plugin_tb_n_insns(const struct block* block);
void qemu_plugin_register_vcpu_tb_exec_inline(struct block* block, enum inline_operation operation,
                                              void* word, uint64_t amount);
void qemu_plugin_register_vcpu_syscall_cb(uint64_t id,
                                          void (*called)(uint64_t, unsigned, int64_t, uint64_t,
                                                         uint64_t, uint64_t, uint64_t, uint64_t,
                                                         uint64_t, uint64_t, uint64_t));

EXPORTED int qemu_plugin_version = 1;

static uint64_t instructions;

static void on_translation(uint64_t id, struct block* block) {
  (void)id;
  qemu_plugin_register_vcpu_tb_exec_inline(block, ADD_TO_WORD, &instructions,
                                           qemu_plugin_tb_n_insns(block));
}

static void on_syscall(uint64_t id, unsigned processor, int64_t number, uint64_t descriptor,
                       uint64_t request, uint64_t a3, uint64_t a4, uint64_t a5, uint64_t a6,
                       uint64_t a7, uint64_t a8) {
  (void)id, (void)processor, (void)number, (void)a3, (void)a4, (void)a5, (void)a6, (void)a7,
      (void)a8;
  if ((uint32_t)request != COUNT_REQUEST) return;
  /* An empty pipe tells the guest that there is no count. */
  ssize_t written = write((int)descriptor, &instructions, sizeof instructions);
  (void)written;
}

EXPORTED int qemu_plugin_install(uint64_t id, const void* info, int arguments, char** argument) {
  (void)info, (void)arguments, (void)argument;
  qemu_plugin_register_vcpu_tb_trans_cb(id, on_translation);
  qemu_plugin_register_vcpu_syscall_cb(id, on_syscall);
  return 0;
}
