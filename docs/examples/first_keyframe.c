/* First keyframe in C: ten scans into a pipeline in our own memory, static cells out. */
#include <stdio.h>
#include <stdlib.h>
#include <unimapper.h>

enum { kPoints = 1000, kScans = 10 };

/* A wall 10 m ahead; your driver fills this. Any stride will do, nothing is copied. */
static float scan[kPoints][4]; /* x y z intensity */

static void fill_scan(void) {
  int i;
  for (i = 0; i < kPoints; ++i) {
    scan[i][0] = 10.0F;
    scan[i][1] = 0.1F * (float)i - 50.0F;
    scan[i][2] = -1.0F;
  }
}

static int print_keyframe(um_pipeline* pipeline) {
  static uint8_t labels[kPoints];
  um_keyframe keyframe;
  size_t count = 0;
  keyframe.struct_size = sizeof keyframe;
  if (um_keyframe_get(pipeline, &keyframe) != UM_OK) return 1;
  if (um_labels(pipeline, 0, labels, kPoints, &count) != UM_OK) return 1;
  printf("keyframe %u: %lu static cells, %lu labels in its first scan\n",
         (unsigned)keyframe.sequence, (unsigned long)keyframe.static_cell_count,
         (unsigned long)count);
  return 0;
}

static int run(um_pipeline* pipeline) {
  const um_points points = {scan, kPoints, sizeof scan[0], 0, sizeof(float), 2 * sizeof(float)};
  const double rotation[4] = {0.0, 0.0, 0.0, 1.0}; /* x y z w, from your odometry */
  double translation[3] = {0.0, 0.0, 0.0};         /* metres */
  int k;
  for (k = 0; k < kScans; ++k) {
    um_pose T_odometry_sensor;
    int32_t ready = 0;
    um_status status;
    translation[0] = 0.1 * k;
    status = um_pose_from_quaternion(rotation, translation, &T_odometry_sensor);
    if (status != UM_OK) return puts(um_status_text(status)), 1;
    status = um_add_scan(pipeline, &points, &T_odometry_sensor, k * (int64_t)100000000, &ready);
    if (status != UM_OK) puts(um_message(pipeline)); /* this scan is refused, the next may do */
    if (ready && print_keyframe(pipeline) != 0) return 1;
  }
  return 0;
}

int main(void) {
  um_config config;
  um_pipeline* pipeline;
  const char* message;
  char* block;
  size_t bytes;
  int failed;

  um_config_init(&config, sizeof config, UM_SENSOR_OS2_128);
  config.loop_search_max_places = 200; /* whatever the robot is to do differently; */
  if (um_config_set(&config, "removal.window", "8", &message) != UM_OK) return puts(message), 1;
  if (um_config_check(&config, &message) != UM_OK) return puts(message), 1;
  bytes = um_required_bytes(&config); /* exact, before anything runs */
  block = malloc(bytes + UM_ALIGNMENT);
  if (block == NULL) return puts("out of memory"), 1;
  if (um_init(&config, block + UM_ALIGNMENT - (uintptr_t)block % UM_ALIGNMENT, bytes, &pipeline,
              &message) != UM_OK) {
    return puts(message), 1;
  }
  fill_scan();
  failed = run(pipeline);
  free(block); /* there is nothing else to clean up */
  return failed;
}
