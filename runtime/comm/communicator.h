/// \file The processes that a run is spread over: those of MPI where a launcher started the program
/// under it, else this one alone.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

// The C interface only: the C++ one is gone from the standard.
#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>

#include "physics/base/types.h"

namespace lahar {

/// MPI for the lifetime of this object, started only where the environment says that a launcher
/// (mpirun, srun) started the program: without one, nothing of MPI is touched. Throws RankError
/// where MPI lacks the thread level that is needed, MPI_THREAD_SERIALIZED.
class MpiSession {
 public:
  MpiSession(int& argc, char**& argv);
  /// All processes end here together. One that fails calls leave() before.
  ~MpiSession();
  /// To be called with the message of an error before the process ends: shows it, once where
  /// several ranks have the same. Ranks that do not come here as well within two seconds are
  /// ended, by MPI_Abort() with `code`, as they may be waiting for this one for ever.
  static void leave(int code, const std::string& message);
  /// For that message: all ranks have finished the steps before `step`.
  static void steps_done(Index step);
  MpiSession(const MpiSession&) = delete;
  MpiSession& operator=(const MpiSession&) = delete;
};

/// A group of processes, numbered from 0. A cheap handle: copies mean the same group. Every member
/// function but rank() and size() is collective, waits for all others, and is for starting, for
/// ending and for the times between in which no step is taken; none may be called while steps are.
class Communicator {
 public:
  Communicator() = default;     ///< this process alone, even under MPI
  static Communicator world();  ///< all processes of the MpiSession; alone if there is none

  int rank() const { return rank_; }
  int size() const { return size_; }
  bool several() const { return size_ > 1; }
  MPI_Comm communicator() const { return communicator_; }  ///< MPI_COMM_NULL = alone

  /// The same processes, but messages of their own. To be released by release(), collectively.
  Communicator duplicate() const;
  void release();
  /// The first `n` of them, as a group with messages of its own, to be released; the others get a
  /// handle that must not be used.
  Communicator first(int n) const;

  /// Called again and again by whoever waits in a function of this class, or of a copy of this
  /// object, for other ranks, which may need it: they may still be busy with something in which
  /// this one has a part. Must neither throw nor wait. Empty = nothing.
  void while_waiting(std::function<void()> poll) const;

  void wait_for_all() const;
  double min(double value) const;
  double max(double value) const;
  Index min(Index value) const;
  Index max(Index value) const;
  Index sum(Index value) const;
  bool any(bool value) const { return max(Index{value}) != 0; }
  /// Sums of each element; all ranks give as many.
  void sum(std::span<Index> values) const;
  void min(std::span<Index> values) const;  ///< the least of each element

  /// Those on the machine of this one, as a group with messages of its own, to be released.
  Communicator on_machine() const;
  /// By rank, a number of its machine.
  std::vector<int> machines() const;
  /// Whether each machine has, for the ranks on it, as many cores as these have threads, as far as
  /// the system lets them use. Collective.
  bool have_cores(int threads) const;

  /// What rank `root` has.
  void broadcast(std::string& text, int root = 0) const;

  /// The values of all ranks, one after the other.
  template <class T>
  std::vector<T> gather_all(std::span<const T> values) const {
    static_assert(std::is_trivially_copyable_v<T>);
    return from_bytes<T>(gather_bytes(std::as_bytes(values)));
  }
  /// to[r] goes to rank r; returns what each rank had for this one. Of any size.
  template <class T>
  std::vector<std::vector<T>> exchange(const std::vector<std::vector<T>>& to) const {
    static_assert(std::is_trivially_copyable_v<T>);
    std::vector<std::span<const std::byte>> parts;
    for (const auto& part : to) parts.push_back(std::as_bytes(std::span(part)));
    std::vector<std::vector<T>> from;
    for (auto& part : exchange_bytes(parts)) from.push_back(from_bytes<T>(std::move(part)));
    return from;
  }

 private:
  void wait_for(std::span<MPI_Request> requests) const;
  void wait_for(MPI_Request request) const { wait_for(std::span(&request, 1)); }
  void become_group(const Communicator& whole);
  template <class T>
  void reduce_all(std::span<T> values, MPI_Datatype type, MPI_Op op) const;
  template <class T>
  T reduce(T value, MPI_Datatype type, MPI_Op op) const;
  std::vector<std::byte> gather_bytes(std::span<const std::byte> bytes) const;
  std::vector<std::vector<std::byte>> exchange_bytes(
      const std::vector<std::span<const std::byte>>& to) const;
  template <class T>
  static std::vector<T> from_bytes(std::vector<std::byte>&& bytes) {
    if constexpr (std::is_same_v<T, std::byte>) {
      return std::move(bytes);
    } else {
      std::vector<T> values(bytes.size() / sizeof(T));
      if (!values.empty())  // bytes of values: a copy is all that is needed
        std::copy_n(bytes.data(), bytes.size(), reinterpret_cast<std::byte*>(values.data()));
      return values;
    }
  }

  MPI_Comm communicator_ = MPI_COMM_NULL;
  int rank_ = 0, size_ = 1;
  std::shared_ptr<std::function<void()>> poll_;  ///< where there are several
};

}  // namespace lahar
