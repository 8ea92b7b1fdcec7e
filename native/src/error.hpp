// SPDX-License-Identifier: BSD-3-Clause
// What can go wrong, as the C ABI tells it.
#pragma once

#include <stdexcept>
#include <string>

#include "swarmevo.h"

namespace swarmevo {

class Error : public std::runtime_error {
  public:
    Error(swe_status status, const std::string& message) : std::runtime_error(message), status_(status) {}
    swe_status status() const { return status_; }

  private:
    swe_status status_;
};

}  // namespace swarmevo
