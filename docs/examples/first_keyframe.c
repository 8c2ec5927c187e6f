/* First keyframe in C: ten scans into a pipeline in our own memory, static cells out. */
#include <stdio.h>
#include <stdlib.h>
#include <unimapper.h>

enum { kPoints = 1000 };
static float scan[kPoints][4]; /* x y z intensity: your driver fills this, nothing is copied */
static uint8_t labels[kPoints];

int main(void) {
  const um_points points = {scan, kPoints, sizeof scan[0], 0, sizeof(float), 2 * sizeof(float)};
  const double xyzw[4] = {0, 0, 0, 1}, metres[3] = {0, 0, 0}; /* from your odometry */
  um_config config;
  um_pipeline* pipeline;
  const char* message;
  int32_t ready;
  if (um_config_init(&config, UM_SENSOR_OS2_128) != UM_OK) return 1;
  config.loop_search_max_places = 200; /* whatever the robot is to do differently */
  if (um_config_set(&config, "removal.window", "8", &message) != UM_OK) return puts(message), 1;
  const size_t bytes = um_required_bytes(&config); /* exact, before anything runs */
  char* const block = malloc(bytes + UM_ALIGNMENT);
  if (block == NULL) return puts("out of memory"), 1;
  void* const memory = block + UM_ALIGNMENT - (uintptr_t)block % UM_ALIGNMENT;
  if (um_init(&config, memory, bytes, &pipeline, &message) != UM_OK) return puts(message), 1;

  for (int i = 0; i < kPoints; ++i) scan[i][0] = 10.0F, scan[i][1] = 0.1F * (float)i - 50.0F;
  for (int k = 0; k < 10; ++k) {
    um_pose pose; /* of the sensor in the odometry frame */
    if (um_pose_from_quaternion(xyzw, metres, &pose) != UM_OK) continue;
    if (um_add_scan(pipeline, &points, &pose, k * (int64_t)100000000, &ready) != UM_OK)
      puts(um_message(pipeline)); /* this scan is refused, the next may do */
    um_keyframe keyframe;
    size_t count = 0;
    if (ready && um_keyframe_get(pipeline, &keyframe) == UM_OK &&
        um_labels(pipeline, 0, labels, kPoints, &count) == UM_OK)
      printf("keyframe %u: %zu static cells, %zu labels in its first scan\n", keyframe.sequence,
             keyframe.static_cell_count, count);
  }
  free(block); /* there is nothing else to clean up */
}
