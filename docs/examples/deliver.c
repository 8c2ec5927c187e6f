/* Delivery in C: keyframes over LCM, kept on the robot's disk until a base has them. */
#include <ports/delivery/unimapper_delivery.h>
#include <stdio.h>
#include <unimapper.h>
static float scan[1000][3]; /* your driver fills this */
static _Alignas(UM_ALIGNMENT) unsigned char memory[64 << 20], scratch[8 << 20], buffer[1 << 20];
static um_delivery_options options;
static um_session session; /* this robot, this start of it */

int main(int argc, char** argv) {
  const um_points points = {scan, 1000, sizeof scan[0], 0, sizeof(float), 2 * sizeof(float)};
  const um_pose T_odometry_sensor = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
  um_delivery* delivery;
  um_delivery_status status;
  um_config config;
  um_pipeline* pipeline;
  um_encoded encoded;
  char why[200];
  int32_t ready = 0;
  um_delivery_options_init(&options);
  options.robot = 7, options.name = "robot7", options.sensor = "vlp-16";
  options.url = argc > 1 ? argv[1] : "udpm://239.255.76.67:7667?ttl=1";
  options.spool = argc > 2 ? argv[2] : "spool"; /* what an earlier start left there is sent too */
  if (um_delivery_create(&options, &delivery, why, sizeof why) != 0) return puts(why), 1;
  if (um_delivery_session(delivery, &session.robot, &session.boot_high, &session.boot_low) ||
      um_config_init_for(&config, UM_SENSOR_VLP_16, UM_COMPUTER_ARMV7_WITH_64_MB) ||
      um_init(&config, memory, sizeof memory, &pipeline, NULL))
    return 1;
  for (int k = 0; k < 1000; ++k) scan[k][0] = 10.0F, scan[k][1] = 0.1F * (float)k - 50.0F;
  for (int k = 1; k <= 20; ++k) {
    if (um_add_scan(pipeline, &points, &T_odometry_sensor, k, &ready) || !ready) continue;
    const um_status encode = um_keyframe_encode(pipeline, &session, scratch, sizeof scratch, buffer,
                                                sizeof buffer, &encoded);
    if (encode == UM_NO_KEYFRAME) continue; /* the robot stands: it repeats what was sent */
    if (encode || um_delivery_publish(delivery, buffer, encoded.bytes, k)) return 1;
  }
  if (um_delivery_finish(delivery) || um_delivery_status_get(delivery, &status)) return 1;
  printf("%d keyframes, %d acknowledged\n", (int)status.published, (int)status.acknowledged);
  um_delivery_destroy(delivery);
}
