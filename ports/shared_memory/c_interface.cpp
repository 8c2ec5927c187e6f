// Shared memory for C: unimapper_share.h over Reader and Writer.
#include <cerrno>
#include <memory>

#include "ports/shared_memory/c_keyframe.hpp"
#include "ports/shared_memory/content_reader.hpp"
#include "ports/shared_memory/content_writer.hpp"
#include "ports/shared_memory/reader.hpp"
#include "ports/shared_memory/unimapper_share.h"
#include "ports/shared_memory/writer.hpp"

using namespace unimapper;
using namespace unimapper::shared_memory;

namespace {

/// What is in the opaque memory; the number tells it from zeros.
struct ReaderObject {
  std::uint64_t made;
  Reader reader;
  Sample sample;  // goes before its reader
};
struct WriterObject {
  std::uint64_t made;
  Writer writer;
};
// Highest values of descriptor.max_keypoints and loop_search.max_results.
constexpr std::uint32_t kMaxKeypoints = 255;
constexpr std::uint32_t kMaxLoops = 256;
constexpr std::uint64_t kMade = 0x756E697368617265ULL;
static_assert(sizeof(ReaderObject) <= sizeof(um_share_reader));
static_assert(sizeof(WriterObject) <= sizeof(um_share_writer));
static_assert(alignof(ReaderObject) <= 8 && alignof(WriterObject) <= 8);
static_assert(sizeof(um_share_cell) == sizeof(SharedCell));
static_assert(UM_SHARE_KEYFRAME == content_of(ContentKind::kKeyframe));
static_assert(UM_SHARE_LABELS == content_of(ContentKind::kLabels));
static_assert(UM_SHARE_HEALTH == content_of(ContentKind::kHealth));

/// The object in `opaque`, or null if none was made there.
template <typename Object, typename Opaque>
Object* object_in(Opaque* opaque) {
  auto* object = reinterpret_cast<Object*>(opaque);
  return object != nullptr && object->made == kMade ? object : nullptr;
}

template <typename Object, typename Opaque>
void destroy(Opaque* opaque) {
  if (auto* object = object_in<Object>(opaque)) {
    object->made = 0;
    std::destroy_at(object);
  }
}

template <typename Object, typename Opaque>
Object* make(Opaque* opaque) {
  destroy<Object>(opaque);
  auto* object = std::construct_at(reinterpret_cast<Object*>(opaque));
  object->made = kMade;
  return object;
}

const Reader* reader_in(const um_share_reader* opaque) {
  const auto* object = reinterpret_cast<const ReaderObject*>(opaque);
  return object != nullptr && object->made == kMade ? &object->reader : nullptr;
}

int tell(const Outcome& outcome, const char** message) {
  if (message != nullptr) *message = outcome.message;
  if (outcome.ok) return 0;
  return outcome.error_number != 0 ? outcome.error_number : EINVAL;
}

um_share_cells cells_of(const Elements<SharedCell>& cells, const Section& section,
                        const um_share_message& message) {
  return {static_cast<const unsigned char*>(message.bytes) + section.offset, cells.size(),
          section.stride};
}

}  // namespace

int um_share_open(um_share_reader* reader, const char* share, const char* topic, uint32_t content,
                  int oldest, const char** message) {
  if (reader == nullptr || share == nullptr || topic == nullptr) {
    return tell({false, EINVAL, "a pointer that is needed is null"}, message);
  }
  ReaderOptions options;
  options.content = content;
  if (oldest != 0) options.start = ReaderOptions::Start::kOldest;
  auto* object = make<ReaderObject>(reader);
  const Outcome outcome = object->reader.open(share, topic, options);
  if (!outcome.ok) destroy<ReaderObject>(reader);
  return tell(outcome, message);
}

void um_share_close(um_share_reader* reader) { destroy<ReaderObject>(reader); }

int um_share_wait(um_share_reader* reader, int64_t timeout_ns) {
  const Reader* open = reader_in(reader);
  return open != nullptr && open->wait(timeout_ns) ? 1 : 0;
}

int um_share_take(um_share_reader* reader, um_share_message* message) {
  auto* object = object_in<ReaderObject>(reader);
  if (object == nullptr || message == nullptr) return -1;
  const Taken taken = object->reader.take(object->sample);
  if (taken != Taken::kMessage) return taken == Taken::kNothing ? 0 : -1;
  const Sample& sample = object->sample;
  *message = {sample.bytes().data(), sample.bytes().size(), sample.stamp_ns(),
              sample.sequence(),     sample.writer(),       sample.missed()};
  return 1;
}

int um_share_intact(const um_share_reader* reader) {
  const auto* object = reinterpret_cast<const ReaderObject*>(reader);
  return reader_in(reader) != nullptr && object->sample.intact() ? 1 : 0;
}

void um_share_release(um_share_reader* reader) {
  if (auto* object = object_in<ReaderObject>(reader)) object->sample.release();
}

int um_share_is_replaced(const um_share_reader* reader) {
  const Reader* open = reader_in(reader);
  return open == nullptr || open->is_replaced() ? 1 : 0;
}

int um_share_has_writer(const um_share_reader* reader) {
  const Reader* open = reader_in(reader);
  return open != nullptr && open->has_writer() ? 1 : 0;
}

int um_share_read_keyframe(const um_share_message* message, um_share_keyframe* keyframe) {
  if (message == nullptr || keyframe == nullptr || message->bytes == nullptr) return 0;
  const auto read = read_keyframe({static_cast<const std::byte*>(message->bytes), message->size});
  if (!read) return 0;
  const SharedKeyframe& fixed = read->fixed;
  keyframe->boot_high = fixed.head.boot_high;
  keyframe->boot_low = fixed.head.boot_low;
  keyframe->robot = fixed.head.robot;
  keyframe->sequence = fixed.head.number;
  std::memcpy(keyframe->rotation, fixed.T_odometry_keyframe, sizeof keyframe->rotation);
  std::memcpy(keyframe->translation, fixed.T_odometry_keyframe + 9, sizeof keyframe->translation);
  keyframe->static_cells = cells_of(read->static_cells, fixed.static_cells, *message);
  keyframe->dynamic_cells = cells_of(read->dynamic_cells, fixed.dynamic_cells, *message);
  return 1;
}

int um_share_writer_open(um_share_writer* writer, const char* share, const char* topic,
                         const um_share_options* options, const char** message) {
  if (writer == nullptr || share == nullptr || topic == nullptr || options == nullptr) {
    return tell({false, EINVAL, "a pointer that is needed is null"}, message);
  }
  if (options->audience > 2) {
    return tell({false, EINVAL, "the audience is 0, 1 or 2"}, message);
  }
  WriterOptions chosen;
  chosen.message_bytes = options->message_bytes;
  chosen.consumers = options->consumers;
  chosen.leases = options->leases;
  chosen.history = options->history;
  chosen.content = options->content;
  chosen.audience = static_cast<Audience>(options->audience);
  auto* object = make<WriterObject>(writer);
  const Outcome outcome = object->writer.open(share, topic, chosen);
  if (!outcome.ok) destroy<WriterObject>(writer);
  return tell(outcome, message);
}

void* um_share_loan(um_share_writer* writer, size_t* bytes) {
  auto* object = object_in<WriterObject>(writer);
  const std::span<std::byte> memory =
      object != nullptr ? object->writer.loan() : std::span<std::byte>{};
  if (bytes != nullptr) *bytes = memory.size();
  return memory.empty() ? nullptr : memory.data();
}

uint32_t um_share_publish(um_share_writer* writer, size_t bytes, int64_t stamp_ns) {
  auto* object = object_in<WriterObject>(writer);
  return object != nullptr ? object->writer.publish(bytes, stamp_ns) : 0;
}

uint32_t um_share_reclaim(um_share_writer* writer) {
  auto* object = object_in<WriterObject>(writer);
  return object != nullptr ? object->writer.reclaim() : 0;
}

size_t um_share_keyframe_room(uint32_t cells, uint32_t planes) {
  PipelineConfig config;
  config.keyframe.scans = KeyframeConfig::kMaxScans;
  config.voxel.max_cells = cells;
  config.descriptor.max_keypoints = kMaxKeypoints;
  config.descriptor.max_planes = planes;
  config.loop_search.max_results = kMaxLoops;
  return static_cast<size_t>(max_keyframe_bytes(config));
}

uint32_t um_share_publish_keyframe(um_share_writer* writer, const um_keyframe* keyframe,
                                   uint32_t robot, uint64_t boot_high, uint64_t boot_low) {
  auto* object = object_in<WriterObject>(writer);
  if (object == nullptr || keyframe == nullptr) return 0;
  const SessionId session{robot, {boot_high, boot_low}};
  const std::size_t bytes = write_c_keyframe(*keyframe, session, object->writer.loan());
  return bytes == 0 ? 0 : object->writer.publish(bytes, stamp_of(*keyframe));
}

void um_share_writer_close(um_share_writer* writer) { destroy<WriterObject>(writer); }

void um_share_writer_remove(um_share_writer* writer) {
  if (auto* object = object_in<WriterObject>(writer)) object->writer.remove();
  destroy<WriterObject>(writer);
}
