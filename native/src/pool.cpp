// SPDX-License-Identifier: BSD-3-Clause
#include "pool.hpp"

#include <unistd.h>

#include <exception>
#include <string>

#include "error.hpp"

namespace swarmevo {

Pool::Pool(unsigned threads) : process_(getpid()) {
    try {
        for (unsigned i = 1; i < threads; ++i) workers_.emplace_back([this] { work(); });
    } catch (const std::exception& error) {  // no more to be had: those that run must end first
        const std::string came = std::to_string(1 + workers_.size());
        stop();
        throw Error(SWE_OUT_OF_MEMORY, "threads: expected " + std::to_string(threads) + " from the system, got " +
                                           came + " (" + error.what() +
                                           "): ask for fewer, or raise its limit (ulimit -u)");
    }
}

Pool::~Pool() {
    stop();
}

void Pool::stop() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    started_.notify_all();
    for (std::thread& worker : workers_) worker.join();
}

bool Pool::is_here() const {
    return workers_.empty() || process_ == getpid();
}

void Pool::for_each(std::size_t n, const std::function<void(std::size_t)>& body) {
    if (!is_here())
        throw Error(SWE_INVALID_ARGUMENT, "batch: expected the process that made it, got a fork of it, where its " +
                                              std::to_string(workers_.size()) +
                                              " worker threads are not: make another");
    {
        const std::lock_guard lock(mutex_);
        body_ = &body;
        n_ = n;
        next_ = 0;
        busy_ = static_cast<unsigned>(workers_.size());
        ++round_;
    }
    started_.notify_all();
    take_indices();
    std::unique_lock lock(mutex_);
    finished_.wait(lock, [this] { return busy_ == 0; });
}

void Pool::work() {
    std::uint64_t done = 0;
    std::unique_lock lock(mutex_);
    while (true) {
        started_.wait(lock, [&] { return stopping_ || round_ != done; });
        if (stopping_) return;
        done = round_;
        lock.unlock();
        take_indices();
        lock.lock();
        if (--busy_ == 0) finished_.notify_one();
    }
}

void Pool::take_indices() {
    for (std::size_t i = next_++; i < n_; i = next_++) (*body_)(i);
}

}  // namespace swarmevo
