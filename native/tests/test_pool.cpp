// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <string>
#include <vector>

#include "error.hpp"
#include "fixture.hpp"
#include "pool.hpp"

using namespace swarmevo;

namespace {

constexpr unsigned kThreadsGiven = 4;  // to a process with few threads
constexpr int kPassed = 0, kNotLimited = 77;

// May this process, from now on, have no more than a few threads? The system limits users, but not root.
bool limit_threads() {
    constexpr uid_t kNobodyElse = 54321;  // a user without other threads
    if (geteuid() == 0 && setuid(kNobodyElse) != 0) return false;
    const rlimit few = {kThreadsGiven, kThreadsGiven};
    return setrlimit(RLIMIT_NPROC, &few) == 0;
}

// Calls `exits` in a fork of this process and returns its exit status; if it hangs or crashes, that of a signal.
template <typename Test>
int in_a_fork(Test exits) {
    std::fflush(nullptr);  // or both print what is in the buffers
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        alarm(60);
        _exit(exits());
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

void check_with_few_threads(bool (*passes)()) {
    const int status = in_a_fork([&] {
        if (!limit_threads()) return kNotLimited;
        return passes() ? kPassed : 1;
    });
    if (status == kNotLimited)
        MESSAGE("not tested: this system does not let its threads be limited");
    else
        CHECK(status == kPassed);
}

bool is_clear(const std::string& message) {
    return message.find("threads: expected 64 from the system, got ") == 0 &&
           message.find("ask for fewer") != std::string::npos && message.find('\n') == std::string::npos;
}

}  // namespace

TEST_CASE("every index is visited once, on any number of threads, again and again") {
    for (const unsigned threads : {1u, 2u, 8u}) {
        Pool pool(threads);
        for (const std::size_t n : {0u, 1u, 7u, 1000u}) {
            std::vector<std::atomic<int>> visits(n);
            pool.for_each(n, [&](std::size_t i) { ++visits[i]; });
            for (const auto& count : visits) CHECK(count == 1);
        }
    }
}

TEST_CASE("a pool that gets too few threads is one clear error, and ends those that it got") {
    check_with_few_threads([] {
        for (int i = 0; i < 20; ++i)  // a thread left running would end the process
            try {
                Pool(64);
                return false;
            } catch (const Error& error) {
                if (error.status() != SWE_OUT_OF_MEMORY || !is_clear(error.what())) return false;
            }
        std::atomic<int> visits{0};
        Pool(1).for_each(10, [&](std::size_t) { ++visits; });
        return visits == 10;
    });
}

TEST_CASE("a batch that gets too few threads says so, and a smaller one runs") {
    check_with_few_threads([] {
        Fixture fixture;
        fixture.config.episode.horizon = 0.2;
        swe_scene* scene = nullptr;
        if (swe_scene_create(&scene, &fixture.config) != SWE_OK) return false;
        swe_batch* batch = nullptr;
        if (swe_batch_create(&batch, scene, 64) != SWE_OUT_OF_MEMORY || batch) return false;
        if (!is_clear(swe_error_message())) return false;

        if (swe_batch_create(&batch, scene, 1) != SWE_OK) return false;
        const swe_policy stand{[](const void*, const double*, double*, double* c) { c[0] = c[1] = 0; }, nullptr, 0, 0,
                               0};
        const swe_episode episode{1, 0, 0, 0};
        const std::vector<std::uint32_t> drivers(5, 0);
        swe_outcome outcome{};
        double homing[5];
        const swe_status status =
            swe_batch_run(&outcome, homing, nullptr, 0, batch, &episode, 1, &stand, 1, drivers.data());
        swe_batch_destroy(batch);
        swe_scene_destroy(scene);
        return status == SWE_OK && outcome.status == SWE_OK;
    });
}

// Case 74.
TEST_CASE("a fork cannot use the threads of a pool, and says so") {
    for (const unsigned threads : {1u, 3u}) {
        Pool pool(threads);
        pool.for_each(10, [](std::size_t) {});
        CHECK(in_a_fork([&] {
                  try {
                      std::atomic<int> visits{0};
                      pool.for_each(10, [&](std::size_t) { ++visits; });
                      return threads == 1 && visits == 10 ? kPassed : 1;
                  } catch (const Error& error) {
                      return threads > 1 && error.status() == SWE_INVALID_ARGUMENT ? kPassed : 1;
                  }
              }) == kPassed);
    }
}

// Case 74.
TEST_CASE("a fork that destroys a batch goes on") {
    Fixture fixture;
    swe_scene* scene = nullptr;
    REQUIRE(swe_scene_create(&scene, &fixture.config) == SWE_OK);
    for (const unsigned threads : {1u, 3u}) {
        swe_batch* batch = nullptr;
        REQUIRE(swe_batch_create(&batch, scene, threads) == SWE_OK);
        CHECK(in_a_fork([&] {
                  swe_batch_destroy(batch);
                  return kPassed;
              }) == kPassed);
        swe_batch_destroy(batch);
    }
    swe_scene_destroy(scene);
}
