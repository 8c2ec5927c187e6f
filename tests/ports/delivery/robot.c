/* Robot in C99 that maps, encodes and delivers; what it prints is read by link_test.sh.
 *
 * robot URL SPOOL KEY KEYFRAMES finish|abandon: "-" for no spool or key. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ports/c/unimapper.h"
#include "ports/delivery/unimapper_delivery.h"

#define REQUIRE(condition) \
  if (!(condition)) return fprintf(stderr, "line %d: %s\n", __LINE__, #condition), 1

enum { kPoints = 1000, kCapacity = 1 << 20, kAlignment = UM_ALIGNMENT };
static float scan[kPoints][3];
static unsigned char buffer[kCapacity];
static unsigned char pipeline_block[(64 << 20) + kAlignment];
static unsigned char scratch_block[(8 << 20) + kAlignment];

static const char* or_null(const char* argument) {
  return strcmp(argument, "-") != 0 ? argument : NULL;
}

static void print_report(void* context, const char* sentence) {
  fprintf((FILE*)context, "report: %s\n", sentence);
}

/* The first aligned byte of a block that has UM_ALIGNMENT bytes more than needed. */
static void* aligned(unsigned char* block) {
  return block + (kAlignment - (size_t)block % kAlignment);
}

int main(int argc, char** argv) {
  const um_points points = {scan, kPoints, sizeof scan[0], 0, sizeof(float), 2 * sizeof(float)};
  const um_pose T_odometry_sensor = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
  um_delivery_options options;
  um_delivery_status status;
  um_delivery* delivery;
  um_session session = {0, 0, 0, 0};
  um_config config;
  um_pipeline* pipeline;
  um_encoded encoded;
  um_health health;
  char message[256] = "";
  const char* sentence = "";
  void* const scratch = aligned(scratch_block);
  int32_t ready = 0;
  int64_t stamp_ns = 0;
  int k, keyframes, made = 0;
  REQUIRE(argc == 6);
  keyframes = atoi(argv[4]);

  REQUIRE(um_delivery_options_init(&options) == 0);
  options.name = "c_robot";
  options.sensor = "vlp-16";
  options.url = argv[1];
  options.spool = or_null(argv[2]);
  options.key = or_null(argv[3]);
  options.report = print_report;
  options.queue_keyframes = 64; /* it does not wait for scans */
  options.report_context = stderr;
  if (um_delivery_create(&options, &delivery, message, sizeof message) != 0) {
    return fprintf(stderr, "%s\n", message), 1;
  }
  REQUIRE(um_delivery_session(delivery, &session.robot, &session.boot_high, &session.boot_low) ==
          0);

  REQUIRE(um_config_init_for(&config, UM_SENSOR_VLP_16, UM_COMPUTER_ARMV7_WITH_64_MB) == UM_OK);
  REQUIRE(um_init(&config, aligned(pipeline_block), 64 << 20, &pipeline, &sentence) == UM_OK);
  for (k = 0; k < kPoints; ++k) scan[k][0] = 10.0F, scan[k][1] = 0.1F * (float)k - 50.0F;
  while (made < keyframes) {
    stamp_ns += 100000000;
    REQUIRE(um_add_scan(pipeline, &points, &T_odometry_sensor, stamp_ns, &ready) == UM_OK);
    if (!ready) continue;
    REQUIRE(um_keyframe_encode(pipeline, &session, scratch, 8 << 20, buffer, kCapacity, &encoded) ==
            UM_OK);
    REQUIRE(um_delivery_publish(delivery, buffer, encoded.bytes, stamp_ns) == 0);
    REQUIRE(um_health_get(pipeline, &health) == UM_OK);
    REQUIRE(um_delivery_set_health(delivery, &health) == 0);
    ++made;
  }

  if (strcmp(argv[5], "finish") == 0) REQUIRE(um_delivery_finish(delivery) == 0);
  REQUIRE(um_delivery_status_get(delivery, &status) == 0);
  printf("published=%lu acknowledged=%lu lost=%lu ended=%lu clock=%lu refused=%s\n",
         (unsigned long)status.published, (unsigned long)status.acknowledged,
         (unsigned long)status.lost, (unsigned long)status.end_is_known,
         (unsigned long)status.clock_is_known, status.answers_refused > 0 ? "some" : "none");
  printf("earlier: sessions=%lu delivered=%lu keyframes=%lu acknowledged=%lu lost=%lu\n",
         (unsigned long)status.earlier_sessions, (unsigned long)status.earlier_delivered,
         (unsigned long)status.earlier_keyframes, (unsigned long)status.earlier_acknowledged,
         (unsigned long)status.earlier_lost);
  um_delivery_destroy(delivery);
  return 0;
}
