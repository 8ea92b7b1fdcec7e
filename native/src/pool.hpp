// SPDX-License-Identifier: BSD-3-Clause
// Worker threads that share out the indices of a loop.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace swarmevo {

class Pool {
  public:
    // The calling thread is one of `threads`. Throws Error(SWE_OUT_OF_MEMORY) if the system gives no more.
    explicit Pool(unsigned threads);
    ~Pool();
    Pool(const Pool&) = delete;
    Pool& operator=(const Pool&) = delete;

    // Whether its threads are in this process. They are not in a fork of the one that made it: there it can be neither
    // used nor destroyed, for both wait for them.
    bool is_here() const;

    // Calls body(i) for every i below n, each once, in no particular order; returns when all are done.
    // `body` must not throw. Throws Error(SWE_INVALID_ARGUMENT) if the threads are not here.
    void for_each(std::size_t n, const std::function<void(std::size_t)>& body);

  private:
    void stop();
    void work();
    void take_indices();

    std::mutex mutex_;
    std::condition_variable started_, finished_;
    const std::function<void(std::size_t)>* body_ = nullptr;
    std::size_t n_ = 0;
    std::atomic<std::size_t> next_{0};
    std::uint64_t round_ = 0;  // of work; grows by one with each for_each
    unsigned busy_ = 0;        // workers that have not finished the round
    bool stopping_ = false;
    std::vector<std::thread> workers_;
    const pid_t process_;  // that made it
};

}  // namespace swarmevo
