/* A robot programmed in C: scans in, the bytes of keyframes out, one file each. */
#include <stdio.h>
#include <stdlib.h>
#include <unimapper.h>

#include "street.h"

static Street street;

static void* aligned_block(size_t bytes) {
  void* const block = aligned_alloc(UM_ALIGNMENT, (bytes / UM_ALIGNMENT + 1) * UM_ALIGNMENT);
  if (block == NULL) exit(puts("out of memory"));
  return block;
}

/* Asks for the size, then encodes; the message could be sent by any transport. */
static int write_keyframe(um_pipeline* pipeline, void* scratch, const char* directory,
                          unsigned sequence) {
  const um_session session = {1, 0, 0, 11};
  const size_t scratch_bytes = um_encode_scratch_bytes(pipeline);
  um_encoded encoded;
  char path[512];
  FILE* file;
  unsigned char* buffer;
  if (um_keyframe_encode(pipeline, &session, scratch, scratch_bytes, NULL, 0, &encoded) !=
      UM_BUFFER_TOO_SMALL) {
    return puts(um_message(pipeline)), 1;
  }
  buffer = malloc(encoded.bytes);
  if (buffer == NULL || um_keyframe_encode(pipeline, &session, scratch, scratch_bytes, buffer,
                                           encoded.bytes, &encoded) != UM_OK) {
    return puts(um_message(pipeline)), 1;
  }
  snprintf(path, sizeof path, "%s/%06u.keyframe", directory, sequence);
  file = fopen(path, "wb");
  if (file == NULL || fwrite(buffer, 1, encoded.bytes, file) != encoded.bytes) {
    return puts("the keyframe cannot be written"), 1;
  }
  fclose(file);
  free(buffer);
  return 0;
}

int main(int argc, char** argv) {
  um_config config;
  um_pipeline* pipeline;
  const char* message;
  size_t bytes;
  void* memory;
  void* scratch;
  unsigned keyframes = 0;
  int scan;
  if (argc != 2) return puts("usage: record_session DIRECTORY"), 2;
  if (um_config_init_for(&config, UM_SENSOR_VLP_16, UM_COMPUTER_JETSON) != UM_OK) {
    return puts("the sensor or the computer is unknown"), 1;
  }
  bytes = um_required_bytes(&config);
  memory = aligned_block(bytes);
  if (um_init(&config, memory, bytes, &pipeline, &message) != UM_OK) {
    return puts(message), 1;
  }
  scratch = aligned_block(um_encode_scratch_bytes(pipeline));
  street_build(&street);
  for (scan = 0; scan < kScans; ++scan) {
    const um_points points = {street.points, kPoints,          sizeof street.points[0], 0,
                              sizeof(float), 2 * sizeof(float)};
    const double rotation[4] = {0.0, 0.0, 0.0, 1.0};
    double position[3];
    um_pose T_odometry_sensor;
    int32_t ready = 0;
    street_scan(&street, scan, 0.0);
    street_sensor(scan, 0.0, position);
    if (um_pose_from_quaternion(rotation, position, &T_odometry_sensor) != UM_OK) {
      return puts("the pose is invalid"), 1;
    }
    if (um_add_scan(pipeline, &points, &T_odometry_sensor, scan * (int64_t)100000000, &ready) !=
        UM_OK) {
      return puts(um_message(pipeline)), 1;
    }
    if (ready && write_keyframe(pipeline, scratch, argv[1], keyframes++) != 0) return 1;
  }
  free(scratch);
  free(memory);
  printf("%u keyframes written\n", keyframes);
  return keyframes > 0 ? 0 : 1;
}
