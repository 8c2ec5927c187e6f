// Recorder: what a robot on this computer shares, message by message into a file.
#include <cstdio>
#include <string>

#include "ports/shared_memory/content_reader.hpp"
#include "ports/shared_memory/reader.hpp"

using namespace unimapper::shared_memory;

int main(int argc, char** argv) {
  if (argc != 3) return std::puts("usage: record_shared NAME FILE"), 1;
  Reader reader;
  ReaderOptions options;
  options.start = ReaderOptions::Start::kOldest;  // all that the ring still holds
  options.content = content_of(ContentKind::kKeyframe);
  if (const Outcome opened = reader.open(argv[1], kKeyframeTopic, options); !opened.ok)
    return std::puts(opened.message), 1;
  std::FILE* const file = std::fopen(argv[2], "wb");
  if (file == nullptr) return std::perror(argv[2]), 1;

  unsigned recorded = 0;
  bool whole = true;
  while (whole && reader.wait(1'000'000'000)) {  // one second without a message ends it
    Sample sample;
    if (reader.take(sample) != Taken::kMessage) continue;
    const auto bytes = sample.bytes();  // in the writer's memory: no copy but the file's
    const auto size = static_cast<unsigned long long>(bytes.size());
    whole = std::fwrite(&size, sizeof size, 1, file) == 1 &&
            std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
    if (!sample.intact()) std::puts("the robot took this message back");  // it was too slow
    ++recorded;
  }
  whole = std::fclose(file) == 0 && whole;
  std::printf("%u keyframes recorded, %u missed\n", recorded, reader.missed());
  return whole ? 0 : 1;
}
