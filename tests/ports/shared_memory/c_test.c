/* Program in C99 that publishes, reads and refuses; ends with the line that failed. */
#include <errno.h>
#include <stdio.h>

#include "ports/shared_memory/unimapper_share.h"

#define REQUIRE(condition) \
  if (!(condition)) return fprintf(stderr, "%s\n", #condition), __LINE__ % 200 + 1

static um_share_writer writer, second;
static um_share_reader reader;

int main(int argc, char** argv) {
  const um_share_options options = {64, 2, 1, 2, 5, 0};
  um_share_message message;
  um_share_keyframe keyframe;
  const char* sentence = NULL;
  size_t bytes = 0;
  const char* share = argc > 1 ? argv[1] : "c-test";
  REQUIRE(um_share_open(&reader, share, "c", 5, 0, &sentence) == ENOENT && sentence[0] != 0);
  REQUIRE(um_share_take(&reader, &message) == -1);
  REQUIRE(um_share_loan(&writer, &bytes) == NULL && bytes == 0);
  REQUIRE(um_share_publish(&writer, 1, 0) == 0);
  REQUIRE(um_share_writer_open(&writer, share, "c", &options, &sentence) == 0);
  REQUIRE(um_share_writer_open(&second, share, "c", &options, NULL) == EBUSY);
  REQUIRE(um_share_open(&reader, share, "c", 6, 0, &sentence) == EPROTO);
  REQUIRE(um_share_open(&reader, share, "c", 5, 0, &sentence) == 0);
  REQUIRE(um_share_take(&reader, &message) == 0);
  memcpy(um_share_loan(&writer, &bytes), "hello", 5);
  REQUIRE(bytes == 64);
  REQUIRE(um_share_publish(&writer, 5, 12) == 1);
  REQUIRE(um_share_wait(&reader, 1000000000) == 1);
  REQUIRE(um_share_take(&reader, &message) == 1);
  REQUIRE(message.size == 5 && memcmp(message.bytes, "hello", 5) == 0);
  REQUIRE(message.sequence == 1 && message.stamp_ns == 12 && message.missed == 0);
  REQUIRE(um_share_intact(&reader) == 1);
  REQUIRE(um_share_read_keyframe(&message, &keyframe) == 0);
  REQUIRE(um_share_has_writer(&reader) == 1 && um_share_is_replaced(&reader) == 0);
  um_share_release(&reader);
  REQUIRE(um_share_intact(&reader) == 0);
  REQUIRE(um_share_reclaim(&writer) == 0);
  REQUIRE(um_share_publish_keyframe(&writer, NULL, 7, 0, 0) == 0);
  REQUIRE(um_share_keyframe_room(1000, 100) > 16 * 1000 + 24 * 100);
  um_share_writer_close(&writer);
  REQUIRE(um_share_has_writer(&reader) == 0);
  REQUIRE(um_share_writer_open(&writer, share, "c", &options, NULL) == 0);
  um_share_writer_remove(&writer);
  REQUIRE(um_share_is_replaced(&reader) == 1);
  um_share_close(&reader);
  um_share_close(&reader);
  return 0;
}
