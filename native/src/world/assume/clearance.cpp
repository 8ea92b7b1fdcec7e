// SPDX-License-Identifier: BSD-3-Clause
// Bodies that would need a push by others to meet within the step do not meet, and have no contact. Where they met all
// the same, all that is near gets one, until the step holds.
#include "world/assume/list.hpp"

namespace swarmevo {
namespace {

class Clearance : public Assumption {
  public:
    explicit Clearance(State& state) : state_(state) {}

    void before_contacts(Attempt& attempt) override { attempt.is_cautious = failed_; }

    Finding check(Attempt&) override {
        const bool kept_clear = state_.average.kept_clear();
        failed_ |= !kept_clear;
        return {kept_clear};
    }

    void accept(const Attempt&) override { failed_ = false; }

  private:
    State& state_;
    bool failed_ = false;  // in this step
};

}  // namespace

std::unique_ptr<Assumption> assume_clearance(State& state) {
    return std::make_unique<Clearance>(state);
}

}  // namespace swarmevo
