#include "runtime/trace/record/recorder.h"

#include <zlib.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>

#include "physics/base/error.h"
#include "runtime/base/stage_clock.h"

namespace lahar {

std::string_view name_of(TraceKind kind) {
  constexpr std::array<std::string_view, trace_kinds> names{
      "task",  "unpack",     "dt",    "send",    "arrival", "agreement", "completed", "poll",
      "frame", "checkpoint", "trace", "counter", "delay",   "rounds",    "direct"};
  return names[static_cast<std::size_t>(kind)];
}

struct TraceRecorder::Buffer {
  static constexpr std::size_t capacity = 16384;  // 1 MiB
  std::atomic<bool> has_thread{true};
  std::uint16_t thread;
  std::vector<TraceRecord> records;
};

TraceRecorder::TraceRecorder(std::filesystem::path file, TraceWindow window,
                             const std::string& head)
    : path_(std::move(file)), window_(window) {
  static std::atomic<std::uint64_t> count{0};
  number_ = ++count;
  file_ = std::fopen(path_.c_str(), "wb");
  if (!file_)
    throw IoError("cannot write the trace " + path_.string() + ": " + std::strerror(errno));
  std::fwrite(trace_magic.data(), 1, trace_magic.size(), file_);
  write(TraceSection::Kind::head, head.data(), head.size());
}

TraceRecorder::~TraceRecorder() {
  if (file_) std::fclose(file_);  // a run that failed: what it did until then, without a tail
}

TraceRecorder::Buffer& TraceRecorder::own_buffer() {
  // Threads that write checkpoints come and go: the next takes the buffer of one that has ended.
  struct Holding {
    std::uint64_t owner = 0;
    std::shared_ptr<Buffer> buffer;
    void release() {
      if (buffer) buffer->has_thread.store(false, std::memory_order_release);
    }
    ~Holding() { release(); }
  };
  thread_local Holding own;
  if (own.owner != number_) {
    own.release();
    const std::scoped_lock lock(mutex_);
    own.owner = number_;
    own.buffer = free_buffer();
  }
  return *own.buffer;
}

std::shared_ptr<TraceRecorder::Buffer> TraceRecorder::free_buffer() {
  for (const auto& buffer : buffers_)
    if (!buffer->has_thread.exchange(true, std::memory_order_acquire)) return buffer;
  auto& buffer = buffers_.emplace_back(std::make_shared<Buffer>());
  buffer->thread = static_cast<std::uint16_t>(buffers_.size() - 1);
  buffer->records.reserve(Buffer::capacity);
  return buffer;
}

std::uint16_t TraceRecorder::add(TraceRecord record) {
  Buffer& buffer = own_buffer();
  record.thread = buffer.thread;
  buffer.records.push_back(record);
  if (buffer.records.size() + 1 < Buffer::capacity) return buffer.thread;
  TraceRecord writing{.begin = ticks(), .step = record.step, .kind = TraceKind::trace};
  {
    const std::scoped_lock lock(mutex_);
    flush(buffer);
  }
  writing.thread = buffer.thread;
  writing.end = ticks();
  buffer.records.push_back(writing);
  return buffer.thread;
}

void TraceRecorder::flush(Buffer& buffer) {
  if (buffer.records.empty()) return;
  write(TraceSection::Kind::records, buffer.records.data(),
        buffer.records.size() * sizeof(TraceRecord));
  records_ += static_cast<std::int64_t>(buffer.records.size());
  buffer.records.clear();
}

void TraceRecorder::write(TraceSection::Kind kind, const void* data, std::size_t bytes) {
  const TraceSection section{
      .kind = kind,
      .crc = static_cast<std::uint32_t>(
          ::crc32(0, static_cast<const unsigned char*>(data), static_cast<uInt>(bytes))),
      .bytes = bytes};
  failed_ |= std::fwrite(&section, sizeof section, 1, file_) != 1;
  failed_ |= bytes > 0 && std::fwrite(data, bytes, 1, file_) != 1;
}

void TraceRecorder::add_graph(const std::string& graph) {
  const std::scoped_lock lock(mutex_);
  write(TraceSection::Kind::graph, graph.data(), graph.size());
}

void TraceRecorder::finish(const std::string& tail) {
  const std::scoped_lock lock(mutex_);
  for (const auto& buffer : buffers_) flush(*buffer);
  write(TraceSection::Kind::tail, tail.data(), tail.size());
  failed_ |= std::fclose(file_) != 0;
  file_ = nullptr;
  if (failed_)
    throw IoError("the trace " + path_.string() +
                  " could not be written: is the disk full? (--trace-steps bounds its size)");
}

}  // namespace lahar
