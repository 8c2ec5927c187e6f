/* A helper on a second core, in C: sem_post and sem_wait are the RTOS's (docs/porting.md). */
#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <stdio.h>
#include <unimapper.h>

static um_part job; /* with its task: written while no part is left and none runs */
static void* job_task;
static uint32_t job_parts;
static atomic_uint left, unfinished; /* parts that nobody has begun, and that are not done */
static sem_t bell;

static void take_parts(uint32_t worker) {
  for (unsigned seen = atomic_load(&left); seen != 0; seen = atomic_load(&left)) {
    if (!atomic_compare_exchange_weak(&left, &seen, seen - 1)) continue; /* another took it */
    job(job_task, job_parts - seen, worker); /* read only after taking: it may be a new job */
    atomic_fetch_sub(&unfinished, 1);
  }
}
static void run(void* context, uint32_t parts, um_part part, void* task) {
  (void)context, job = part, job_task = task, job_parts = parts;
  atomic_store(&unfinished, parts);
  atomic_store(&left, parts); /* from here on the helper may take some */
  sem_post(&bell);
  take_parts(0);
  while (atomic_load(&unfinished) != 0) continue; /* what the helper has begun */
}
static void* helper(void* unused) { /* the task, or the second core's main function */
  for (;; sem_wait(&bell)) take_parts(1);
  return unused;
}
int main(void) {
  pthread_t thread;
  um_config config;
  if (um_config_init(&config, UM_SENSOR_VLP_16) != UM_OK || sem_init(&bell, 0, 0)) return 1;
  if (pthread_create(&thread, NULL, helper, NULL)) return 1;
  config.executor = (um_executor){run, NULL, 2}; /* then um_init and um_add_scan as always */
  return printf("%d MB with two workers\n", (int)(um_required_bytes(&config) >> 20)) < 0;
}
