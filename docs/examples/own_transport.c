/* A transport of your own in C: keyframes as bytes, for any radio or cable. */
#include <stdio.h>
#include <stdlib.h>
#include <unimapper.h>

enum { kPoints = 1000, kCapacity = 1 << 20 };
static float scan[kPoints][3]; /* your driver fills this */
static unsigned char buffer[kCapacity];

int main(void) {
  const um_points points = {scan, kPoints, sizeof scan[0], 0, sizeof(float), 2 * sizeof(float)};
  const um_session session = {7, 0, 0x5be0cd19u, 0x1f83d9abu}; /* boot: random, every start */
  const double rotation[4] = {0.0, 0.0, 0.0, 1.0}, translation[3] = {0.0, 0.0, 0.0};
  um_config config;
  um_pipeline* pipeline;
  um_pose T_odometry_sensor;
  um_encoded encoded;
  const char* message;
  int32_t ready = 0;
  if (um_config_init(&config, UM_SENSOR_VLP_16) != UM_OK) return 1;
  const size_t bytes = um_required_bytes(&config);
  void* const memory = aligned_alloc(UM_ALIGNMENT, bytes);
  if (um_init(&config, memory, bytes, &pipeline, &message) != UM_OK) return puts(message), 1;
  const size_t scratch_bytes = um_encode_scratch_bytes(pipeline);
  void* const scratch = aligned_alloc(UM_ALIGNMENT, scratch_bytes);
  for (int k = 0; k < kPoints; ++k) scan[k][0] = 10.0F, scan[k][1] = 0.1F * (float)k - 50.0F;
  if (um_pose_from_quaternion(rotation, translation, &T_odometry_sensor) != UM_OK) return 1;
  for (int k = 0; k < 10; ++k) {
    if (um_add_scan(pipeline, &points, &T_odometry_sensor, k + 1, &ready) != UM_OK || !ready)
      continue;
    const um_status status =
        um_keyframe_encode(pipeline, &session, scratch, scratch_bytes, buffer, kCapacity, &encoded);
    if (status == UM_NO_KEYFRAME) continue; /* the robot stands: it repeats what was sent */
    if (status != UM_OK) return puts(um_message(pipeline)), 1;
    /* Send them here: the base station decodes these bytes (docs/wire-format.md). */
    printf("%lu bytes sent\n", (unsigned long)encoded.bytes);
  }
  free(scratch);
  free(memory);
}
