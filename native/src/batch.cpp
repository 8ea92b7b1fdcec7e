// SPDX-License-Identifier: BSD-3-Clause
#include "batch.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <new>
#include <utility>

#include "error.hpp"

namespace swarmevo {
namespace {

EpisodeKey key_of(const swe_episode& e) {
    return {e.seed, e.trial, e.generation, e.repeat};
}

// The episode whose policies this thread runs.
thread_local const swe_episode* running = nullptr;

// A plugin's compiled policy may call exit(): the process would end as if all were well. Where several threads call it,
// each takes the next function that was registered: the first one speaks and ends the process, the others wait for
// that.
void name_episode_at_exit() {
    if (!running) return;
    static std::atomic_flag is_told = ATOMIC_FLAG_INIT;
    while (is_told.test_and_set()) pause();
    std::fprintf(stderr, "error: trial %u, generation %u, repeat %u: a compiled policy ended the process\n",
                 running->trial, running->generation, running->repeat);
    _exit(EXIT_FAILURE);
}

// Threads that run policies now, and how often the function above is registered: as often as there ever were threads at
// once.
std::atomic<unsigned> threads_running = 0, registered = 0;

class Running {
  public:
    explicit Running(const swe_episode& episode) {
        const unsigned wanted = ++threads_running;
        for (unsigned known = registered; known < wanted;) {
            if (registered.compare_exchange_weak(known, known + 1)) std::atexit(name_episode_at_exit);
        }
        running = &episode;
    }
    ~Running() {
        running = nullptr;
        --threads_running;
    }
    Running(const Running&) = delete;
    Running& operator=(const Running&) = delete;
};

// Runs each robot's policy until the episode is over.
void run_episode(Episode& episode, const Scene& scene, const swe_policy* policies,
                 const std::uint32_t* robot_policies) {
    std::size_t memory_size = 0;
    for (unsigned robot = 0; robot < scene.robots; ++robot) memory_size += policies[robot_policies[robot]].memory;
    std::vector<double> memory(memory_size), commands(scene.robots * scene.commands);

    while (!episode.done()) {
        const double* observations = episode.observe();
        double* own_memory = memory.data();
        for (unsigned robot = 0; robot < scene.robots; ++robot) {
            const swe_policy& policy = policies[robot_policies[robot]];
            policy.function(policy.parameters, observations + robot * scene.suite.size(), own_memory,
                            &commands[robot * scene.commands]);
            own_memory += policy.memory;
        }
        episode.advance(commands.data());
    }
}

}  // namespace

Batch::Batch(std::shared_ptr<const Scene> scene, unsigned threads) : scene_(std::move(scene)), pool_(threads) {}

// An episode that fails fails alone.
template <typename Body>
void Batch::attempt(std::size_t i, Body body) {
    if (statuses_[i] != SWE_OK) return;
    try {
        body();
    } catch (const Error& error) {
        statuses_[i] = error.status();
        messages_[i] = error.what();
    } catch (const std::bad_alloc&) {
        statuses_[i] = SWE_OUT_OF_MEMORY;
        messages_[i] = "out of memory";
    } catch (const std::exception& error) {
        statuses_[i] = SWE_INTERNAL_ERROR;
        messages_[i] = error.what();
    }
}

swe_outcome Batch::finish(std::size_t i, const Episode* episode, double* homing_times) const {
    if (statuses_[i] == SWE_OK) return episode->outcome(homing_times);
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    std::fill_n(homing_times, scene_->robots, unknown);
    swe_outcome outcome{};
    outcome.status = statuses_[i];
    outcome.push_time = unknown;
    return outcome;
}

void Batch::run(swe_outcome* outcomes, double* homing_times, const std::vector<Recorder>& records,
                const swe_episode* episodes, std::size_t n, const swe_policy* policies,
                const std::uint32_t* robot_policies) {
    messages_.assign(n, "");
    statuses_.assign(n, SWE_OK);
    pool_.for_each(n, [&](std::size_t i) {
        std::unique_ptr<Episode> episode;
        attempt(i, [&] {
            episode = std::make_unique<Episode>(*scene_, key_of(episodes[i]), records[i]);
            const Running named(episodes[i]);
            run_episode(*episode, *scene_, policies, robot_policies + i * scene_->robots);
        });
        outcomes[i] = finish(i, episode.get(), homing_times + i * scene_->robots);
    });
}

// Begins a world's episode, in place of the one before.
void Batch::start(std::size_t i, const swe_episode& episode) {
    statuses_[i] = SWE_OK;
    messages_[i].clear();
    lockstep_[i].reset();
    attempt(i, [&] { lockstep_[i] = std::make_unique<Episode>(*scene_, key_of(episode), records_[i]); });
}

void Batch::begin(std::vector<Recorder> records, const swe_episode* episodes, std::size_t n) {
    messages_.assign(n, "");
    statuses_.assign(n, SWE_OK);
    records_ = std::move(records);
    lockstep_.clear();
    lockstep_.resize(n);
    pool_.for_each(n, [&](std::size_t i) { start(i, episodes[i]); });
    running_ = true;
}

std::size_t Batch::movable() const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < lockstep_.size(); ++i) count += can_go_on(i);
    return count;
}

std::size_t Batch::failed() const {
    return lockstep_.size() - static_cast<std::size_t>(std::count(statuses_.begin(), statuses_.end(), SWE_OK));
}

void Batch::observe(double* observations) {
    const std::size_t size = scene_->robots * scene_->suite.size();
    pool_.for_each(lockstep_.size(), [&](std::size_t i) {
        double* own = observations + i * size;
        std::fill_n(own, size, 0.0);
        attempt(i, [&] { std::copy_n(lockstep_[i]->observe(), size, own); });
    });
}

void Batch::advance(const double* commands) {
    const std::size_t size = scene_->robots * scene_->commands;
    pool_.for_each(lockstep_.size(), [&](std::size_t i) {
        if (can_go_on(i)) attempt(i, [&] { lockstep_[i]->advance(commands + i * size); });
    });
}

void Batch::reset(const std::uint32_t* worlds, const swe_episode* episodes, std::size_t n) {
    pool_.for_each(n, [&](std::size_t i) { start(worlds[i], episodes[i]); });
}

void Batch::state(swe_outcome* outcomes, double* homing_times, const std::vector<Recorder>& channels) {
    pool_.for_each(lockstep_.size(), [&](std::size_t i) {
        for (const Track& track : channels[i])
            std::fill_n(track.values, track.channel->size(*scene_), std::numeric_limits<double>::quiet_NaN());
        attempt(i, [&] {
            if (channels[i].empty()) return;
            const Moment now = lockstep_[i]->moment();
            for (const Track& track : channels[i]) track.channel->write(track.values, now);
        });
    });
    std::vector<double> unwanted(homing_times ? 0 : scene_->robots);
    for (std::size_t i = 0; outcomes && i < lockstep_.size(); ++i)
        outcomes[i] = finish(i, lockstep_[i].get(), homing_times ? homing_times + i * scene_->robots : unwanted.data());
}

void Batch::end(swe_outcome* outcomes, double* homing_times) {
    for (std::size_t i = 0; i < lockstep_.size(); ++i)
        outcomes[i] = finish(i, lockstep_[i].get(), homing_times + i * scene_->robots);
    lockstep_.clear();
    records_.clear();
    running_ = false;
}

const std::string& Batch::message(std::size_t i) const {
    static const std::string none;
    return i < messages_.size() ? messages_[i] : none;
}

}  // namespace swarmevo
