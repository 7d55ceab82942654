/// \file A library to preload that fails the n-th call of a kind, as a disk, the system or MPI may.
///
///     LAHAR_FAULT=KIND:N       fail the N-th call of this kind, counted from 1
///     LAHAR_FAULT=KIND:N+      and all later ones, as a disk that stays full
///     LAHAR_FAULT_ERRNO=E      the error number that file calls give instead of that below
///     LAHAR_FAULT_CLOCK=S      nothing fails: the wall clock jumps twenty times a second, to S
///                              seconds ahead and to S seconds behind
///     LAHAR_FAULT_RANK=R       only on this rank; without it on all
///     LAHAR_FAULT_UNDER=PATH   file calls count below this folder only
///     LAHAR_FAULT_TRACE=1      show where the call that fails comes from
///     LAHAR_FAULT_COUNTS=FILE  append a line "KIND N" for each kind at the end of the process
///
/// Memory counts from the first file on: before, no program could say anything. Kinds and what they
/// give: open EACCES, write ENOSPC, short (half of the bytes are written), sync
/// EIO, close EIO, read ESTALE, rename EIO, truncate EIO, remove EACCES, folder ENOSPC, new
/// std::bad_alloc, thread EAGAIN, mpi MPI_ERR_OTHER by the communicator's error handler.
#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <mpi.h>
#include <pthread.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string>
#include <string_view>

namespace {

enum Kind {
  opens,
  writes,
  shorts,
  syncs,
  closes,
  reads,
  renames,
  truncates,
  removes,
  folders,
  news,
  threads,
  mpis,
  kinds
};
constexpr std::array<std::string_view, kinds> names{
    "open",     "write",  "short",  "sync", "close",  "read", "rename",
    "truncate", "remove", "folder", "new",  "thread", "mpi"};

/// Plain data alone: it is used before constructors and after destructors have run.
struct State {
  std::atomic<long> calls[kinds]{};
  std::atomic<bool> watched[4096]{};  ///< by file descriptor
  char under[4096]{};
  int kind = kinds;
  long at = 0;
  int number = 0;  ///< of the error; 0 = that of the kind
  long jump = 0;   ///< [s] of the wall clock
  bool goes_on = false;
  bool shows = false;
  std::atomic<bool> begun{false};  ///< a file was opened
};
constinit State state;

template <class Function>
Function next(Function, const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}
#define NEXT(name) static const auto real = next(&::name, #name)

/// Counts a call; true if it has to fail.
bool fails(Kind kind) {
  const long n = state.calls[kind].fetch_add(1, std::memory_order_relaxed) + 1;
  if (state.kind != kind || (n != state.at && !(state.goes_on && n > state.at))) return false;
  if (state.shows) {
    std::array<void*, 64> calls;
    backtrace_symbols_fd(calls.data(), backtrace(calls.data(), 64), STDERR_FILENO);
  }
  return true;
}

bool is_watched(const char* path) {
  return path != nullptr && state.under[0] != 0 &&
         std::strncmp(path, state.under, std::strlen(state.under)) == 0;
}
bool is_watched(int descriptor) {
  return descriptor >= 0 && descriptor < 4096 && state.watched[descriptor];
}
int note(int descriptor, bool watch) {
  if (watch) state.begun = true;
  if (descriptor >= 0 && descriptor < 4096) state.watched[descriptor] = watch;
  return descriptor;
}
template <class Result>
Result error(int number, Result result) {
  errno = state.number != 0 ? state.number : number;
  return result;
}

/// [s] by which the wall clock is wrong at this moment.
long wrong_by() {
  if (state.jump == 0) return 0;
  static const auto real = next(&::clock_gettime, "clock_gettime");
  timespec now{};
  real(CLOCK_MONOTONIC, &now);
  constexpr long interval = 50'000'000;  // [ns]
  const long turns = now.tv_sec * (1'000'000'000 / interval) + now.tv_nsec / interval;
  return turns % 2 == 0 ? state.jump : -state.jump;
}

__attribute__((constructor)) void begin() {
  if (const char* under = std::getenv("LAHAR_FAULT_UNDER"))
    std::strncpy(state.under, under, sizeof state.under - 1);
  const char* fault = std::getenv("LAHAR_FAULT");
  const char* only = std::getenv("LAHAR_FAULT_RANK");
  const char* rank = std::getenv("OMPI_COMM_WORLD_RANK");
  if (const char* number = std::getenv("LAHAR_FAULT_ERRNO")) state.number = std::atoi(number);
  if (const char* jump = std::getenv("LAHAR_FAULT_CLOCK")) state.jump = std::atol(jump);
  if (!fault || (only && std::strcmp(only, rank ? rank : "0") != 0)) return;
  const std::string_view text(fault);
  const auto colon = text.find(':');
  for (int k = 0; k < kinds; ++k)
    if (text.substr(0, colon) == names[static_cast<std::size_t>(k)]) state.kind = k;
  state.at = std::atol(fault + colon + 1);
  state.goes_on = text.back() == '+';
  state.shows = std::getenv("LAHAR_FAULT_TRACE") != nullptr;
}

__attribute__((destructor)) void end() {
  const char* file = std::getenv("LAHAR_FAULT_COUNTS");
  if (!file) return;
  std::string text;
  for (int k = 0; k < kinds; ++k)
    text += std::string(names[static_cast<std::size_t>(k)]) + " " +
            std::to_string(state.calls[k].load()) + "\n";
  if (FILE* out = std::fopen(file, "a")) {
    std::fwrite(text.data(), 1, text.size(), out);
    std::fclose(out);
  }
}

mode_t mode_of(int flags, va_list more) {
  return (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
}

/// What write() and its kin share.
template <class Whole, class Half>
ssize_t write_or_fail(int descriptor, std::size_t bytes, const Whole& whole, const Half& half) {
  if (!is_watched(descriptor)) return whole();
  if (fails(writes)) return error(ENOSPC, ssize_t{-1});
  if (bytes > 1 && fails(shorts)) return half();
  return whole();
}

}  // namespace

extern "C" {

#define OPEN(name)                                                  \
  int name(const char* path, int flags, ...) {                      \
    NEXT(name);                                                     \
    va_list more;                                                   \
    va_start(more, flags);                                          \
    const mode_t mode = mode_of(flags, more);                       \
    va_end(more);                                                   \
    if (is_watched(path) && fails(opens)) return error(EACCES, -1); \
    return note(real(path, flags, mode), is_watched(path));         \
  }
OPEN(open)
OPEN(open64)
#define OPENAT(name)                                                \
  int name(int folder, const char* path, int flags, ...) {          \
    NEXT(name);                                                     \
    va_list more;                                                   \
    va_start(more, flags);                                          \
    const mode_t mode = mode_of(flags, more);                       \
    va_end(more);                                                   \
    if (is_watched(path) && fails(opens)) return error(EACCES, -1); \
    return note(real(folder, path, flags, mode), is_watched(path)); \
  }
OPENAT(openat)
OPENAT(openat64)
#define FOPEN(name)                                                                          \
  FILE* name(const char* path, const char* mode) {                                           \
    NEXT(name);                                                                              \
    if (is_watched(path) && fails(opens)) return error(EACCES, static_cast<FILE*>(nullptr)); \
    FILE* const file = real(path, mode);                                                     \
    if (file) note(fileno(file), is_watched(path));                                          \
    return file;                                                                             \
  }
FOPEN(fopen)
FOPEN(fopen64)

ssize_t write(int file, const void* data, size_t n) {
  NEXT(write);
  return write_or_fail(
      file, n, [&] { return real(file, data, n); }, [&] { return real(file, data, n / 2); });
}
#define PWRITE(name, Offset)                                      \
  ssize_t name(int file, const void* data, size_t n, Offset at) { \
    NEXT(name);                                                   \
    return write_or_fail(                                         \
        file, n, [&] { return real(file, data, n, at); },         \
        [&] { return real(file, data, n / 2, at); });             \
  }
PWRITE(pwrite, off_t)
PWRITE(pwrite64, off64_t)
ssize_t writev(int file, const struct iovec* parts, int n) {
  NEXT(writev);
  return write_or_fail(
      file, parts[0].iov_len, [&] { return real(file, parts, n); },
      [&] { return ::write(file, parts[0].iov_base, parts[0].iov_len / 2); });
}
ssize_t read(int file, void* data, size_t n) {
  NEXT(read);
  if (is_watched(file) && fails(reads)) return error(ESTALE, ssize_t{-1});
  return real(file, data, n);
}
#define PREAD(name, Offset)                                                  \
  ssize_t name(int file, void* data, size_t n, Offset at) {                  \
    NEXT(name);                                                              \
    if (is_watched(file) && fails(reads)) return error(ESTALE, ssize_t{-1}); \
    return real(file, data, n, at);                                          \
  }
PREAD(pread, off_t)
PREAD(pread64, off64_t)
#define SYNC(name)                                               \
  int name(int file) {                                           \
    NEXT(name);                                                  \
    if (is_watched(file) && fails(syncs)) return error(EIO, -1); \
    return real(file);                                           \
  }
SYNC(fsync)
SYNC(fdatasync)
int close(int file) {
  NEXT(close);
  const bool failed = is_watched(file) && fails(closes);
  note(file, false);
  const int status = real(file);
  return failed ? error(EIO, -1) : status;
}
#define FTRUNCATE(name, Offset)                                      \
  int name(int file, Offset size) noexcept {                         \
    NEXT(name);                                                      \
    if (is_watched(file) && fails(truncates)) return error(EIO, -1); \
    return real(file, size);                                         \
  }
FTRUNCATE(ftruncate, off_t)
FTRUNCATE(ftruncate64, off64_t)
int rename(const char* from, const char* to) noexcept {
  NEXT(rename);
  if (is_watched(to) && fails(renames)) return error(EIO, -1);
  return real(from, to);
}
int unlink(const char* path) noexcept {
  NEXT(unlink);
  if (is_watched(path) && fails(removes)) return error(EACCES, -1);
  return real(path);
}
int remove(const char* path) noexcept {
  NEXT(remove);
  if (is_watched(path) && fails(removes)) return error(EACCES, -1);
  return real(path);
}
int mkdir(const char* path, mode_t mode) noexcept {
  NEXT(mkdir);
  if (is_watched(path) && fails(folders)) return error(ENOSPC, -1);
  return real(path, mode);
}
int clock_gettime(clockid_t clock, struct timespec* now) noexcept {
  NEXT(clock_gettime);
  const int status = real(clock, now);
  if (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE) now->tv_sec += wrong_by();
  return status;
}
int gettimeofday(struct timeval* now, void* zone) noexcept {
  NEXT(gettimeofday);
  const int status = real(now, zone);
  now->tv_sec += wrong_by();
  return status;
}
time_t time(time_t* at) noexcept {
  NEXT(time);
  const time_t now = real(nullptr) + wrong_by();
  if (at) *at = now;
  return now;
}
int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*work)(void*),
                   void* argument) noexcept {
  NEXT(pthread_create);
  if (fails(threads)) return EAGAIN;
  return real(thread, attributes, work, argument);
}

}  // extern "C"

// NOLINTBEGIN: replacements of the language's own operators.
void* operator new(std::size_t size) {
  if (!state.begun || !fails(news))
    if (void* const memory = std::malloc(size ? size : 1)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  void* memory = nullptr;
  if ((!state.begun || !fails(news)) &&
      posix_memalign(&memory, std::max(sizeof(void*), static_cast<std::size_t>(alignment)),
                     size ? size : 1) == 0)
    return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  std::free(memory);
}
// NOLINTEND

#define MPI_CALL(name, parameters, arguments, communicator)  \
  int name parameters {                                      \
    if (fails(mpis)) {                                       \
      MPI_Comm_call_errhandler(communicator, MPI_ERR_OTHER); \
      return MPI_ERR_OTHER;                                  \
    }                                                        \
    return P##name arguments;                                \
  }
extern "C" {
MPI_CALL(MPI_Isend,
         (const void* b, int n, MPI_Datatype t, int to, int tag, MPI_Comm c, MPI_Request* r),
         (b, n, t, to, tag, c, r), c)
MPI_CALL(MPI_Irecv, (void* b, int n, MPI_Datatype t, int from, int tag, MPI_Comm c, MPI_Request* r),
         (b, n, t, from, tag, c, r), c)
MPI_CALL(MPI_Iallreduce,
         (const void* s, void* b, int n, MPI_Datatype t, MPI_Op o, MPI_Comm c, MPI_Request* r),
         (s, b, n, t, o, c, r), c)
MPI_CALL(MPI_Ibcast, (void* b, int n, MPI_Datatype t, int root, MPI_Comm c, MPI_Request* r),
         (b, n, t, root, c, r), c)
MPI_CALL(MPI_Iallgather,
         (const void* s, int n, MPI_Datatype t, void* b, int m, MPI_Datatype u, MPI_Comm c,
          MPI_Request* r),
         (s, n, t, b, m, u, c, r), c)
MPI_CALL(MPI_Ibarrier, (MPI_Comm c, MPI_Request* r), (c, r), c)
MPI_CALL(MPI_Send, (const void* b, int n, MPI_Datatype t, int to, int tag, MPI_Comm c),
         (b, n, t, to, tag, c), c)
MPI_CALL(MPI_Recv, (void* b, int n, MPI_Datatype t, int from, int tag, MPI_Comm c, MPI_Status* s),
         (b, n, t, from, tag, c, s), c)
MPI_CALL(MPI_Start, (MPI_Request * r), (r), MPI_COMM_WORLD)
MPI_CALL(MPI_Comm_dup, (MPI_Comm c, MPI_Comm* d), (c, d), c)
}
