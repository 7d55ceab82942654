/// \file A team of readers that are threads of this process.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "io/base/team.h"

namespace lahar {

/// Where the members of a team meet. A member that does not come, because it has ended, ends all.
class MeetingRoom {
 public:
  explicit MeetingRoom(int size) : parcels_(static_cast<std::size_t>(size)), size_(size) {}

  int size() const { return size_; }
  std::vector<Team::Bytes>& parcels(int member) {
    return parcels_[static_cast<std::size_t>(member)];
  }
  void meet() {
    std::unique_lock lock(mutex_);
    const int meeting = meeting_;
    if (++here_ == size_) {
      here_ = 0;
      ++meeting_;
      changed_.notify_all();
      return;
    }
    changed_.wait(lock, [&] { return meeting_ != meeting || gone_; });
    if (meeting_ == meeting) throw std::logic_error("a member of the team did not come");
  }
  void leave() {
    const std::lock_guard lock(mutex_);
    gone_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::vector<Team::Bytes>> parcels_;  ///< of each member for each
  int size_, here_ = 0, meeting_ = 0;
  bool gone_ = false;
};

class ThreadTeam : public Team {
 public:
  ThreadTeam(MeetingRoom& room, int index) : room_(room), index_(index) {}
  int index() const override { return index_; }
  int size() const override { return room_.size(); }

  std::vector<Bytes> gather_bytes(Bytes own) const override {
    return exchange_bytes(std::vector<Bytes>(static_cast<std::size_t>(size()), own));
  }
  std::vector<Bytes> exchange_bytes(std::vector<Bytes> to) const override {
    room_.parcels(index_) = std::move(to);
    room_.meet();
    std::vector<Bytes> from;
    for (int m = 0; m < size(); ++m)
      from.push_back(std::move(room_.parcels(m)[static_cast<std::size_t>(index_)]));
    room_.meet();
    return from;
  }

 private:
  MeetingRoom& room_;
  int index_;
};

/// Let `body(team)` be run by each member of a team; what one throws is thrown when all have ended.
inline void run_team(int size, const std::function<void(const Team&)>& body) {
  MeetingRoom room(size);
  std::vector<std::exception_ptr> errors(static_cast<std::size_t>(size));
  std::vector<std::thread> threads;
  for (int m = 0; m < size; ++m)
    threads.emplace_back([&, m] {
      try {
        body(ThreadTeam(room, m));
      } catch (...) {
        errors[static_cast<std::size_t>(m)] = std::current_exception();
      }
      room.leave();
    });
  for (auto& thread : threads) thread.join();
  for (const auto& error : errors)
    if (error) std::rethrow_exception(error);
}

}  // namespace lahar
